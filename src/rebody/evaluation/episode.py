"""What is kept of one evaluated episode."""

from collections.abc import Hashable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from rebody.tasks import Family, FamilySet
from rebody.tasks.figures import settled
from rebody.types import DECISION_DT

Vector = list[float]


@dataclass(frozen=True)
class EpisodeResult:
    """One episode; entry i of a list is the state after decision i, its belief includes decision i."""

    families: FamilySet
    """Those in play."""
    family: str
    target: Vector
    seed: int
    switch: dict[str, Any] | None
    time_s: list[float]
    quantities: dict[str, list[Any]]
    """What families compare with their targets, by its name: numbers, or vectors where it has several [m, m/s, rad]."""
    reward: list[float]
    active_family: list[str]
    active_target: list[Vector]
    inferred_family: list[str]
    inferred_target: list[Vector]
    cluster: list[int]
    latent: list[Vector]
    subgoal_family: list[str]
    subgoal: list[Vector | None]
    fell: bool
    return_: float
    oracle_return: float | None
    idle_return: float | None
    final_error: float
    final_squared_error: float
    ripple_m_s: float

    @property
    def task(self) -> Hashable:
        """The same for all episodes of one task, whatever their starts."""
        return self.family, tuple(self.target), str(self.switch)

    @property
    def last_family(self) -> Family:
        """That of the task that the episode ends with."""
        return self.families.named(self.active_family[-1])

    @property
    def asked(self) -> list[Family]:
        """Families that were asked for, in their order in time."""
        return [self.families.named(name) for name in dict.fromkeys(self.active_family)]

    @property
    def reached(self) -> Float[np.ndarray, "time size"]:
        """What the last task is about, after each decision [m, m/s, rad]."""
        return self.reached_of(self.last_family)

    def reached_of(self, family: Family) -> Float[np.ndarray, "time size"]:
        """What a family is about, after each decision [m, m/s, rad]: of a jump the largest of a second."""
        series = self._series(family)
        return settled(family, series) if family.settle == "largest of 1 s" else series

    def missed(self) -> Float[np.ndarray, " time"]:
        """How far what the last family settles on is from its target, after each decision [m, m/s, rad]."""
        family = self.last_family
        return family.quantity.distance(settled(family, self._series(family)), np.array(self.active_target[-1]))

    @property
    def arrived_s(self) -> float:
        """From when the last task is given until the error is within tolerance for the first time [s]."""
        return self.seconds_until(self.missed() <= self.last_family.tolerance)

    def seconds_until(self, holds: Bool[np.ndarray, " time"]) -> float:
        """From when the last task is given to the first decision after which something holds; what never does counts
        as long as the episode lasts on [s].
        """
        active = list(zip(self.active_family, self.active_target, strict=True))
        after = holds[active.index(active[-1]) :]
        decisions = np.argmax(after) + 1 if after.any() else len(after)
        return float(decisions * DECISION_DT)

    def base_task_right(self) -> Bool[np.ndarray, " time"]:
        """Whether family and direction are read rightly from the belief after each decision."""
        right = np.array(self.inferred_family) == np.array(self.active_family)
        for family in self.families:
            own = right & (np.array(self.active_family) == family.name)
            if own.any():
                read, asked = (_chosen(each, own) for each in (self.inferred_target, self.active_target))
                right[own] = family.direction(read) == family.direction(asked)
        return right

    def _series(self, family: Family) -> Float[np.ndarray, "time size"]:
        return np.array(self.quantities[family.quantity.name], float).reshape(-1, family.size)

    def to_json(self) -> dict[str, Any]:
        """Under the names of the file format."""
        entry = {field.name: getattr(self, field.name) for field in fields(self) if field.name != "families"}
        entry["return"] = entry.pop("return_")
        if self.switch is None:
            del entry["switch"]
        return entry


def _chosen(vectors: list[Vector], chosen: Bool[np.ndarray, " time"]) -> Float[np.ndarray, "chosen size"]:
    return np.array([vector for vector, is_chosen in zip(vectors, chosen, strict=True) if is_chosen])
