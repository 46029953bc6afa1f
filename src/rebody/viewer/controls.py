"""The panel of controls: what is clicked becomes an order to the page."""

import math
import operator
import queue
import random
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np
import viser

from rebody.errors import RebodyError
from rebody.evaluation.trial import Trial
from rebody.inputs import number
from rebody.names import AGENTS
from rebody.ranges import Box
from rebody.tasks import SHIPPED, FamilySet
from rebody.tasks.family_set import draw
from rebody.tasks.task_file import TaskSpec
from rebody.viewer import words
from rebody.viewer.session import target_range

PUSHES = {"-1": -1.0, "-0.5": -0.5, "+0.5": 0.5, "+1": 1.0}
"""What buttons say, and what they add to the velocity [m/s]."""
SPEEDS, REAL_TIME = (0.1, 2.0), 1.0
"""Slowest and fastest simulation, and the one to begin with, in simulated seconds per second."""
FARTHEST_DRAWN, TRIES = 0.4, 50
"""A task that is drawn at random asks for at least this share of the largest target, if one is found at all."""


@dataclass(frozen=True)
class Choice:
    """Who is watched: names or paths, as on the command line."""

    robot: str
    inference: str
    agent: str


@dataclass(frozen=True)
class Offered:
    """What there is to choose from, beside the agents."""

    robots: Sequence[str]
    inferences: Sequence[str]

    def check(self, choice: Choice) -> None:
        """RebodyError unless all of a choice is offered: a name may be a path, and its file would be opened."""
        _check_among(self.robots, choice.robot, "robot")
        _check_among(self.inferences, choice.inference, "module")
        _check_among(AGENTS, choice.agent, "agent")


@dataclass(frozen=True)
class Push:
    """A change of velocity [m/s]."""

    change: float
    axis: int = 0
    """Along x, or 1 for y."""


@dataclass(frozen=True)
class Restart:
    """Back to the start."""


Order = Choice | TaskSpec | Push | Restart | RebodyError
"""A task is given from now on; an error says why what a browser sent is refused."""


class Controls:
    """Widgets; orders wait in `orders` until the page gets to them.

    viser writes into a widget what a browser sends, of the widget's type but else unchecked. So values are checked when
    they become an order.
    """

    def __init__(self, gui: viser.GuiApi, offered: Offered, choice: Choice):
        self.orders: queue.SimpleQueue[Order] = queue.SimpleQueue()
        self.paused = False
        self._offered = offered
        self._ranges: dict[str, Box] = {}
        self._gui = gui
        gui.add_markdown(words.INTRODUCTION)
        self._status = gui.add_html("")
        self._task = gui.add_folder("Hidden task")
        with self._task:
            self._family = gui.add_dropdown("Kind", SHIPPED.names)
            self._targets = [gui.add_slider("Target", 0.0, 1.0, 0.1, 0.0)]
            self._give = gui.add_button("Change the task now", icon=viser.Icon.TARGET)
            self._draw = gui.add_button("Any other task", icon=viser.Icon.DICE, color="gray")
        with gui.add_folder("The robot"):
            self._pushes = [
                gui.add_button_group(
                    f"{name} [m/s]", tuple(PUSHES), hint=f"Changes the velocity of all its parts{along}"
                )
                for name, along in (("Push", " along x"), ("Push y", " along y"))
            ]
            self._speed = gui.add_slider("Speed [x]", *SPEEDS, 0.1, REAL_TIME, hint="Simulated seconds per second")
            self._pause = gui.add_button("Pause", icon=viser.Icon.PLAYER_PAUSE)
            self._restart = gui.add_button("Restart", icon=viser.Icon.REFRESH, color="gray")
        with gui.add_folder("Who is watched"):
            self._robot = gui.add_dropdown("Robot", offered.robots, initial_value=choice.robot)
            self._inference = gui.add_dropdown(
                "Module", offered.inferences, initial_value=choice.inference, hint="The inference artifact"
            )
            self._agent = gui.add_dropdown("Agent", tuple(AGENTS), initial_value=choice.agent)
        self._connect()

    @property
    def speed(self) -> float:
        """Simulated seconds per second that are asked for; where the slider is off its range, it is put back."""
        try:
            speed = _within(number(self._speed.value, "the speed"), SPEEDS)
        except RebodyError:
            speed = REAL_TIME
        self._speed.value = speed
        return speed

    def show_choice(self, choice: Choice) -> None:
        """Who is watched now."""
        self._robot.value, self._inference.value, self._agent.value = choice.robot, choice.inference, choice.agent

    def show_task(self, trial: Trial, task: TaskSpec) -> None:
        """The hidden task, and which others there are."""
        self._known = trial.inference.contract.families
        self._pushes[1].visible = "y" in trial.inference.contract.fields
        self._ranges = {name: _in_tenths(target_range(trial, name)) for name in self._known.names}
        self._family.hint = "; ".join(f"{family.name}: {family.label}" for family in self._known)
        self._family.options = tuple(self._ranges)
        self._family.value = task.family
        self._show_range(task.family, task.target)

    def show_status(self, html: str) -> None:
        """A line about what goes on."""
        self._status.content = html

    def pause(self, paused: bool = True) -> None:
        """Let the simulation stand still, or go on."""
        self.paused = paused
        self._pause.label = "Go on" if paused else "Pause"
        self._pause.icon = viser.Icon.PLAYER_PLAY if paused else viser.Icon.PLAYER_PAUSE

    def _connect(self) -> None:
        self._give.on_click(self._ordering(lambda _: self._chosen_task()))
        self._draw.on_click(self._ordering(lambda _: self._any_task()))
        for axis, buttons in enumerate(self._pushes):
            buttons.on_click(self._ordering(lambda event, axis=axis: _push(event.target.value, axis)))
        self._restart.on_click(self._ordering(lambda _: Restart()))
        self._pause.on_click(lambda _: self.pause(not self.paused))
        self._family.on_update(self._ordering(lambda _: self._show_range(self._family.value)))
        for who in (self._robot, self._inference, self._agent):
            who.on_update(self._ordering(self._choose))

    def _ordering(self, order: Callable[[viser.GuiEvent], Order | None]) -> Callable[[viser.GuiEvent], None]:
        """A callback that passes on the order, if there is one, or why it is refused."""

        def callback(event: viser.GuiEvent) -> None:
            try:
                made = order(event)
            except RebodyError as error:
                made = error
            if made is not None:
                self.orders.put(made)

        return callback

    def _choose(self, event: viser.GuiEvent) -> Choice | None:
        if event.client is None:  # `show_choice` did it
            return None
        choice = Choice(self._robot.value, self._inference.value, self._agent.value)
        self._offered.check(choice)
        return choice

    def _chosen_task(self) -> TaskSpec:
        family = self._family.value
        _check_among(self._ranges, family, "kind of task")
        box = self._ranges[family]
        said = [number(slider.value, "the target") for slider in self._targets[: box.size]]
        return TaskSpec(family, tuple(map(_within, said, zip(box.low, box.high, strict=True))))

    def _show_range(self, family: str, target: Sequence[float] | None = None) -> None:
        _check_among(self._ranges, family, "kind of task")
        box, quantity = self._ranges[family], self._known.named(family).quantity
        self._add_sliders(quantity.size)
        for i, (slider, low, high) in enumerate(zip(self._targets, box.low, box.high, strict=False)):
            component = f" {quantity.components[i]}" if quantity.size > 1 else ""
            slider.label = f"Target{component} [{quantity.unit}]"
            slider.min, slider.max = low, high
            slider.value = _within(round(high / 2, 1), (low, high)) if target is None else target[i]

    def _add_sliders(self, size: int) -> None:
        """Below the first, as many as a target has numbers; others are put away."""
        with self._task:
            for i in range(len(self._targets), size):
                below = self._targets[0].order + i / 100
                self._targets.append(self._gui.add_slider("Target", 0.0, 1.0, 0.1, 0.0, order=below))
        for i, slider in enumerate(self._targets):
            slider.visible = i < size

    def _any_task(self) -> TaskSpec:
        family = random.choice(list(self._ranges))
        box = self._ranges[family]
        ends, far = list(zip(box.low, box.high, strict=True)), FARTHEST_DRAWN * np.array(box.largest)
        alone, rng = FamilySet((self._known.named(family),)), np.random.default_rng()
        for _ in range(TRIES):
            drawn = draw(alone, rng).target.tolist()
            target = [_within(round(number, 1), each) for number, each in zip(drawn, ends, strict=True)]
            if np.any(np.abs(target) >= far):
                return TaskSpec(family, tuple(target))
        return TaskSpec(family, box.high)


def _in_tenths(box: Box) -> Box:
    """Ends that a slider can be put to; those of the box where little is left between them."""
    low = tuple(math.ceil(10 * end) / 10 for end in box.low)
    high = tuple(math.floor(10 * end) / 10 for end in box.high)
    return Box(low, high) if all(map(operator.lt, low, high)) else box


def _push(button: str, axis: int) -> Push:
    _check_among(PUSHES, button, "push")
    return Push(PUSHES[button], axis)


def _check_among(offered: Collection[str], name: str, what: str) -> None:
    if name not in offered:
        raise RebodyError(f"this {what} is not offered here.")


def _within(value: float, ends: tuple[float, float]) -> float:
    return min(max(value, ends[0]), ends[1])
