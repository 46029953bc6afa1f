"""Which tasks there are, and which of them are for training and for testing."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rebody import inputs
from rebody.errors import RebodyError

Target = float | tuple[float, float] | tuple[str, float]
"""A speed [m/s], a direction, an angle [rad], a place (x, y) [m], or a base task with its target."""

SEED = 1337
"""PEARL's, of cheetah-vel; where the originals fix no seed, ours."""


@dataclass(frozen=True)
class TaskSet:
    """The tasks of one environment."""

    draw: Callable[[np.random.Generator], Target]
    """One of all that there are."""
    train: tuple[Target, ...]
    test: tuple[Target, ...]
    admit: Callable[[Any], Target]
    """A task that a user asks for; RebodyError where it is none."""


def speeds() -> TaskSet:
    """v* uniform in [0, 3] m/s; PEARL's 100 and 30."""
    drawn = tuple(_generator().uniform(0.0, 3.0, size=130).tolist())
    return TaskSet(lambda rng: float(rng.uniform(0.0, 3.0)), drawn[:100], drawn[100:], _number)


def directions() -> TaskSet:
    """Backward and forward."""
    both = (-1.0, 1.0)
    return TaskSet(lambda rng: float(rng.choice(both)), both, both, _sign)


def places() -> TaskSet:
    """Within 3 m, evenly over the disc; 150 and 30. Angles are drawn before radii, as in the original."""
    rng = _generator()
    angle, share = rng.random_sample(180), rng.random_sample(180)
    drawn = tuple(_place(*pair) for pair in zip(angle.tolist(), share.tolist(), strict=True))
    return TaskSet(lambda rng: _place(*rng.random(2).tolist()), drawn[:150], drawn[150:], _pair)


def angles() -> TaskSet:
    """Any direction in the plane; 100 and 30."""
    drawn = tuple(_generator().uniform(0.0, 2.0 * np.pi, size=130).tolist())
    return TaskSet(_angle, drawn[:100], drawn[100:], _number)


def forward_and_backward() -> TaskSet:
    """Any direction in the plane; PEARL's two, for training as for testing."""
    both = (0.0, math.pi)
    return TaskSet(_angle, both, both, _number)


BASE_TASKS = {
    "velocity_forward": (1.0, 5.0),  # m/s
    "velocity_backward": (-1.0, -5.0),
    "goal_forward": (5.0, 25.0),  # m
    "goal_backward": (-5.0, -25.0),
    "flip_forward": (2.0 * math.pi, 4.0 * math.pi),  # rad/s
    "stand_front": (math.pi / 6.0, math.pi / 2.0),  # rad
    "stand_back": (-math.pi / 6.0, -math.pi / 2.0),
    "jump": (1.5, 3.0),  # m/s, up or down
}
"""MELTS' eight, and between which ends their targets lie; shuffled in this order."""


def base_tasks() -> TaskSet:
    """Of each of MELTS' base tasks 10 and 5 targets: 15 evenly between its ends, shuffled."""
    rng, train, test = _generator(), [], []
    for name, (first, last) in BASE_TASKS.items():
        targets = np.linspace(first, last, num=15)
        rng.shuffle(targets)
        tasks = [(name, target) for target in targets.tolist()]
        train, test = train + tasks[:10], test + tasks[10:]
    return TaskSet(_base_task, tuple(train), tuple(test), _named)


def _generator() -> np.random.RandomState:
    """What `numpy.random.seed` and NumPy's global functions draw from."""
    return np.random.RandomState(SEED)


def _place(angle: float, share: float) -> tuple[float, float]:
    """Of two numbers in [0, 1)."""
    bearing, radius = angle * 2 * np.pi, 3 * share**0.5
    return float(radius * np.cos(bearing)), float(radius * np.sin(bearing))


def _angle(rng: np.random.Generator) -> float:
    return float(rng.uniform(0.0, 2.0 * np.pi))


def _base_task(rng: np.random.Generator) -> tuple[str, float]:
    name = list(BASE_TASKS)[rng.integers(len(BASE_TASKS))]
    low, high = sorted(BASE_TASKS[name])
    return name, float(rng.uniform(low, high))


def _number(asked: Any) -> float:
    return inputs.number(asked, "the task")


def _sign(asked: Any) -> float:
    direction = _number(asked)
    if abs(direction) != 1:
        raise RebodyError(f"the task is {direction:g}; give -1 (backward) or 1 (forward).")
    return direction


def _pair(asked: Any) -> tuple[float, float]:
    x, y = inputs.numbers(asked, (2,), "the task").tolist()
    return x, y


def _named(asked: Any) -> tuple[str, float]:
    if not isinstance(asked, list | tuple) or len(asked) != 2 or asked[0] not in BASE_TASKS:
        raise RebodyError(
            f"the task is {asked!r}; give a base task and its target, such as ('goal_forward', 7.5). "
            f"Base tasks are: {', '.join(BASE_TASKS)}."
        )
    target = inputs.number(asked[1], "the task's target")
    if target == 0:
        raise RebodyError("the task's target is 0, and its reward is relative to that; give another.")
    return asked[0], target
