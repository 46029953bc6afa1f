"""The panel of controls: what is clicked becomes an order to the page."""

import math
import queue
import random
from collections.abc import Sequence
from dataclasses import dataclass

import viser

from rebody.agents.build import AGENTS
from rebody.evaluation.evaluate import Trial
from rebody.tasks import FAMILIES, family_index, family_names
from rebody.tasks.task_file import TaskSpec
from rebody.viewer import words
from rebody.viewer.session import target_range

PUSHES = {"-1": -1.0, "-0.5": -0.5, "+0.5": 0.5, "+1": 1.0}
"""What buttons say, and what they add to the velocity [m/s]."""
SPEEDS = (0.1, 2.0)
"""Slowest and fastest simulation, in simulated seconds per second."""
FARTHEST_DRAWN = 0.4
"""A task that is drawn at random asks for at least this share of the largest target."""


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


@dataclass(frozen=True)
class GiveTask:
    """Another hidden task from now on."""

    task: TaskSpec


@dataclass(frozen=True)
class Push:
    """A change of velocity [m/s]."""

    change: float


@dataclass(frozen=True)
class Restart:
    """Back to the start."""


Order = Choice | GiveTask | Push | Restart


class Controls:
    """Widgets; orders wait in `orders` until the page gets to them."""

    def __init__(self, gui: viser.GuiApi, offered: Offered, choice: Choice):
        self.orders: queue.SimpleQueue[Order] = queue.SimpleQueue()
        self.paused = False
        self._ranges: dict[str, tuple[float, float]] = {}
        gui.add_markdown(words.INTRODUCTION)
        self._status = gui.add_html("")
        with gui.add_folder("Hidden task"):
            self._family = gui.add_dropdown(
                "Kind",
                family_names(),
                hint="goal: reach a place; velocity: run; stand: hold a pitch; jump: leave the floor",
            )
            self._target = gui.add_slider("Target", 0.0, 1.0, 0.1, 0.0)
            self._give = gui.add_button("Change the task now", icon=viser.Icon.TARGET)
            self._draw = gui.add_button("Any other task", icon=viser.Icon.DICE, color="gray")
        with gui.add_folder("The robot"):
            self._pushes = gui.add_button_group(
                "Push [m/s]", tuple(PUSHES), hint="Changes the velocity of all its parts"
            )
            self._speed = gui.add_slider("Speed [x]", *SPEEDS, 0.1, 1.0, hint="Simulated seconds per second")
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
        """Simulated seconds per second that are asked for."""
        return self._speed.value

    def show_choice(self, choice: Choice) -> None:
        """Who is watched now."""
        self._robot.value, self._inference.value, self._agent.value = choice.robot, choice.inference, choice.agent

    def show_task(self, trial: Trial, task: TaskSpec) -> None:
        """The hidden task, and which others there are."""
        families = trial.inference.contract.target_ranges
        self._ranges = {name: _in_tenths(*target_range(trial, name)) for name in families}
        self._family.options = tuple(self._ranges)
        self._family.value = task.family
        self._show_range(task.family, task.target)

    def show_status(self, html: str) -> None:
        """A line about what goes on."""
        self._status.content = html

    def _connect(self) -> None:
        order = self.orders.put
        self._give.on_click(lambda _: order(GiveTask(TaskSpec(self._family.value, self._target.value))))
        self._draw.on_click(lambda _: order(GiveTask(self._any_task())))
        self._pushes.on_click(lambda event: order(Push(PUSHES[event.target.value])))
        self._restart.on_click(lambda _: order(Restart()))
        self._pause.on_click(lambda _: self._toggle_pause())
        self._family.on_update(lambda _: self._show_range(self._family.value))
        for who in (self._robot, self._inference, self._agent):
            who.on_update(self._choose)

    def _choose(self, event: viser.GuiEvent) -> None:
        if event.client is not None:  # else `show_choice` did it
            self.orders.put(Choice(self._robot.value, self._inference.value, self._agent.value))

    def _toggle_pause(self) -> None:
        self.paused = not self.paused
        self._pause.label = "Go on" if self.paused else "Pause"
        self._pause.icon = viser.Icon.PLAYER_PLAY if self.paused else viser.Icon.PLAYER_PAUSE

    def _show_range(self, family: str, target: float | None = None) -> None:
        low, high = self._ranges[family]
        self._target.label = f"Target [{FAMILIES[family_index(family)].unit}]"
        self._target.min, self._target.max = low, high
        self._target.value = round(high / 2, 1) if target is None else target

    def _any_task(self) -> TaskSpec:
        family = random.choice(list(self._ranges))
        low, high = self._ranges[family]
        target = 0.0
        while abs(target) < FARTHEST_DRAWN * max(abs(low), abs(high)):
            target = round(random.uniform(low, high), 1)
        return TaskSpec(family, target)


def _in_tenths(low: float, high: float) -> tuple[float, float]:
    return math.ceil(10 * low) / 10, math.floor(10 * high) / 10
