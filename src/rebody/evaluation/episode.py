"""What is kept of one evaluated episode."""

from collections.abc import Hashable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from rebody.tasks import family_named
from rebody.tasks.figures import settled

VECTORS = ("target", "active_target", "inferred_target", "subgoal")
"""Entries of an episode that are vectors in the file."""


@dataclass(frozen=True)
class EpisodeResult:
    """One episode; entry i of a list is the state after decision i, its belief includes decision i."""

    family: str
    target: float
    seed: int
    switch: dict[str, Any] | None
    time_s: list[float]
    quantities: dict[str, list[float]]
    """What families compare with their targets, by its name in the global state [m, m/s, rad]."""
    reward: list[float]
    active_family: list[str]
    active_target: list[float]
    inferred_family: list[str]
    inferred_target: list[float]
    cluster: list[int]
    latent: list[list[float]]
    subgoal_family: list[str]
    subgoal: list[float | None]
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
        return self.family, self.target, str(self.switch)

    @property
    def reached(self) -> list[float]:
        """The number that the last task is about, after each decision [m, m/s, rad]."""
        return self.reached_of(self.active_family[-1])

    @property
    def families(self) -> list[str]:
        """Families that were asked for, in their order in time."""
        return list(dict.fromkeys(self.active_family))

    def reached_of(self, family: str) -> list[float]:
        """The number that a family is about, after each decision [m, m/s, rad]: of a jump the largest of a second."""
        asked = family_named(family)
        quantity = self.quantities[asked.quantity.name]
        return settled(asked, np.array(quantity)).tolist() if asked.settle == "largest of 1 s" else quantity

    def missed(self) -> Float[np.ndarray, " time"]:
        """How far what the last family settles on is from its target, after each decision [m, m/s, rad]."""
        family = family_named(self.active_family[-1])
        judged = settled(family, np.array(self.quantities[family.quantity.name]))
        return np.abs(family.quantity.difference(judged, self.active_target[-1]))

    def to_json(self) -> dict[str, Any]:
        """Under the names of the file format."""
        entry = asdict(self)
        entry["return"] = entry.pop("return_")
        for name in VECTORS:
            entry[name] = _vectors(entry[name])
        if self.switch is None:
            del entry["switch"]
        return entry


def _vectors(value: Any) -> Any:
    """Every number as a vector of one."""
    if isinstance(value, list):
        return [_vectors(entry) for entry in value]
    return None if value is None else [value]
