"""The figures by which an episode is judged: one definition each, on NumPy arrays."""

import numpy as np
from jaxtyping import Float

from rebody.tasks.family import Family
from rebody.tasks.family_set import FamilySet
from rebody.types import DECISION_DT, GlobalState, Task

LAST_S = 2.0
"""The final error is a mean over this many seconds at the end."""
SECOND = round(1.0 / DECISION_DT)
"""Decisions of the second that a family may be judged by."""

Series = Float[np.ndarray, "time *rest"]


def final_error(families: FamilySet, task: Task, state: GlobalState) -> Float[np.ndarray, "*episode"]:
    """Mean over the last 2 s of the distance [m, m/s, rad] between target and quantity, as its family settles it: of a
    velocity the mean of 1 s, of a jump the largest of 1 s.

    `task` is the last one, [*episode]; `state` that after each decision, [time, *episode].
    """
    return _missed(families, task, state, round(LAST_S / DECISION_DT), settles=True).mean(axis=0)


def final_squared_error(families: FamilySet, task: Task, state: GlobalState) -> Float[np.ndarray, "*episode"]:
    """Squared error at the last decision [m^2, (m/s)^2, rad^2], to compare with ReMAP; velocities at that decision."""
    return _missed(families, task, state, 1, settles=False)[-1] ** 2


def ripple(state: GlobalState) -> Float[np.ndarray, "*episode"]:
    """Std over the last 2 s of the 0.1 s velocity about its 1 s mean [m/s]; states are [time, *episode]."""
    velocity = np.asarray(state.vx, float)
    return np.std((velocity - mean_of_last_second(velocity))[-round(LAST_S / DECISION_DT) :], axis=0)


def settled(family: Family, series: Series) -> Series:
    """What a family judges at each moment, of its quantity after each decision, [time, *episode, size]."""
    match family.settle:
        case "mean of 1 s":
            return mean_of_last_second(series)
        case "largest of 1 s":
            return largest_of_last_second(series)
        case _:
            return series


def mean_of_last_second(series: Series) -> Series:
    """Before the first decision a body stands still."""
    return _seconds(series, 0.0).mean(axis=-1)


def largest_of_last_second(series: Series) -> Series:
    """Of those decisions that there were."""
    return _seconds(series, -np.inf).max(axis=-1)


def _missed(families: FamilySet, task: Task, state: GlobalState, last: int, *, settles: bool) -> Series:
    """Distance of each episode at the last decisions; nobody can hold a jump, so it is settled all the same."""
    family, target, of_each = np.asarray(task.family), np.asarray(task.target, float), []
    for each in families:
        series = np.asarray(each.quantity.read(state), float)
        judged = settled(each, series) if settles or each.settle == "largest of 1 s" else series
        of_each.append(each.quantity.distance(judged[-last:], target[..., : each.size]))
    chosen = np.broadcast_to(family, of_each[0].shape)
    return np.take_along_axis(np.stack(of_each), chosen[None], axis=0)[0]


def _seconds(series: Series, before: float) -> Float[np.ndarray, "time *rest decision"]:
    """The second that ends with each decision; `before` stands for what was before the first."""
    padded = np.concatenate([np.full((SECOND - 1, *series.shape[1:]), before), series])
    return np.lib.stride_tricks.sliding_window_view(padded, SECOND, axis=0)
