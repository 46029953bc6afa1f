"""The figures by which an episode is judged: one definition each, on NumPy arrays."""

import numpy as np
from jaxtyping import Float

from rebody.tasks.families import FAMILIES, JUMP, VELOCITY, family_index
from rebody.types import DECISION_DT, GlobalState, Task

LAST_S = 2.0
"""The final error is a mean over this many seconds at the end."""
MEAN_S = 1.0
"""Velocities are judged by the mean over this many seconds."""
JUMP_S = 1.0
"""Jumps are judged by the largest vertical speed of this many seconds: nobody can hold one."""

Series = Float[np.ndarray, "time *episode"]


def final_error(task: Task, state: GlobalState, start: float = 0.0) -> Float[np.ndarray, "*episode"]:
    """Mean over the last 2 s of |y - target| [m, m/s, rad]; a velocity is the displacement over 1 s, a jump the largest
    vertical speed of 1 s.

    `task` is the last one, [*episode]; `state` that after each decision, [time, *episode]; `start` is x before
    the first [m].
    """
    judged = [np.asarray(getattr(state, family.field), float) for family in FAMILIES]
    judged[VELOCITY] = mean_velocity(np.asarray(state.x, float), start)
    judged[JUMP] = fastest_rise(np.asarray(state.vz, float))
    last = round(LAST_S / DECISION_DT)
    return np.abs(_of_family(task, judged)[-last:] - task.target).mean(axis=0)


def final_squared_error(task: Task, state: GlobalState) -> Float[np.ndarray, "*episode"]:
    """Squared error at the last decision [m^2, (m/s)^2, rad^2], to compare with ReMAP."""
    achieved = [np.asarray(getattr(state, family.field), float)[-1:] for family in FAMILIES]
    achieved[JUMP] = fastest_rise(np.asarray(state.vz, float))[-1:]
    return (_of_family(task, achieved)[-1] - task.target) ** 2


def ripple(state: GlobalState) -> Float[np.ndarray, "*episode"]:
    """Std over the last 2 s of the 0.1 s velocity about its 1 s mean [m/s]; states are [time, *episode]."""
    last = round(LAST_S / DECISION_DT)
    position, velocity = np.asarray(state.x, float), np.asarray(state.vx, float)
    return np.std((velocity - mean_velocity(position))[-last:], axis=0)


def tolerance(family: str) -> float:
    """Within which final error an episode counts as solved [m, m/s, rad]."""
    return FAMILIES[family_index(family)].tolerance


def _of_family(task: Task, by_family: list[Series]) -> Series:
    family = np.asarray(task.family)
    chosen = np.broadcast_to(family, (len(by_family[0]), *family.shape))
    return np.take_along_axis(np.stack(by_family), chosen[None], axis=0)[0]


def mean_velocity(position: Series, start: float = 0.0) -> Series:
    """Displacement over the last second, per second [m/s]; `start` is x before the first position [m]."""
    steps = round(MEAN_S / DECISION_DT)
    before = np.concatenate([np.full((steps, *position.shape[1:]), start), position])[: len(position)]
    return (position - before) / MEAN_S


def mean_of_last_second(velocity: Series) -> Series:
    """The mean velocity of the last second [m/s]; before the first decision a body stands still."""
    steps = round(MEAN_S / DECISION_DT)
    padded = np.concatenate([np.zeros((steps - 1, *velocity.shape[1:])), velocity])
    return np.lib.stride_tricks.sliding_window_view(padded, steps, axis=0).mean(axis=-1)


def fastest_rise(vz: Series) -> Series:
    """The largest vertical speed of the last second [m/s]."""
    steps = round(JUMP_S / DECISION_DT)
    padded = np.concatenate([np.full((steps - 1, *vz.shape[1:]), -np.inf), vz])
    return np.lib.stride_tricks.sliding_window_view(padded, steps, axis=0).max(axis=-1)
