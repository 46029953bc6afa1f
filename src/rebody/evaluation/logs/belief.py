"""What a frozen module believes over a logged run."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from rebody.agents.belief import Reading
from rebody.agents.parts import Inference
from rebody.evaluation.logs.file import COLUMNS, REWARD, TIME
from rebody.evaluation.logs.resample import Decisions
from rebody.store.files import written_whole
from rebody.tasks import Family, FamilySet


@dataclass(frozen=True)
class BeliefOverTime:
    """A run and what was believed after each of its decisions."""

    inference: str
    families: FamilySet
    """Those that the module knows."""
    decisions: Decisions
    readings: list[Reading]
    believed: int
    """In how many decisions a reward was heard and believed."""
    doubts: tuple[str, ...] = ()
    """About rewards that no task could have paid."""
    notes: tuple[str, ...] = ()
    """About rewards that no task in the module's ranges would have paid."""
    unexplained: int = 0
    """How many rewards there were last that no task which the module knows explains."""

    @property
    def time_s(self) -> Float[np.ndarray, " decision"]:
        """When each decision ended."""
        return self.decisions.time_s[1:]

    def targets(self, family: Family) -> Float[np.ndarray, "decision size"]:
        """What was read while the family was believed [m, m/s, rad], else NaN."""
        nothing = (np.nan,) * family.size
        return np.array([reading.target if reading.family == family.name else nothing for reading in self.readings])

    @property
    def latent(self) -> Float[np.ndarray, "decision latent"]:
        """Mean of the latent."""
        return np.stack([reading.latent.mean for reading in self.readings])

    @property
    def clusters(self) -> Float[np.ndarray, "decision K"]:
        """Responsibilities of the mixture's clusters; none where there is no mixture."""
        return np.array([list(reading.responsibilities.values()) for reading in self.readings])

    def believes(self, family: Family) -> np.ndarray:
        """Whether the family was the likeliest, at each decision."""
        return np.array([reading.family == family.name for reading in self.readings])

    def conclusion(self) -> str:
        """What is believed at the end, and since when."""
        if not self.believed:
            return "believes nothing: there was no reward that it could believe"
        last = self.readings[-1]
        family = self.families.named(last.family)
        apart = family.quantity.distance(self.targets(family), np.array(last.target))
        is_same, is_close = self.believes(family), np.nan_to_num(apart, nan=np.inf) <= family.tolerance
        target = ", ".join(f"{number:.2f}" for number in last.target)
        return (
            f"believes at {self.time_s[-1]:.1f} s: {last.family} {target} {family.unit}, "
            f"{last.family} with probability {last.probabilities[last.family]:.2f}; {last.family} since "
            f"{self._since(is_same):.1f} s, within {family.tolerance:g} {family.unit} of that since "
            f"{self._since(is_close):.1f} s"
        )

    def _since(self, holds: np.ndarray) -> float:
        """From when on something has held without a break [s]; it holds at the end."""
        broken = np.flatnonzero(~holds)
        return float(self.time_s[broken[-1] + 1 if broken.size else 0])


def believe(inference: Inference, decisions: Decisions, sharpen: bool = False) -> BeliefOverTime:
    """Let a module hear a run, decision by decision; where there is no reward, nothing was heard.

    With `sharpen` its beliefs are refined (docs/sharp-beliefs.md).
    """
    states = [dict(zip(decisions.fields, at, strict=True)) for at in zip(*decisions.fields.values(), strict=True)]
    belief = inference.begin(states[0], sharpen)
    rewards = [None if math.isnan(reward) else float(reward) for reward in decisions.reward]
    readings = [belief.update(*heard) for heard in zip(states[1:], rewards, strict=True)]
    doubts, notes = belief.doubts(math.inf), belief.notes(math.inf)
    families = inference.contract.families
    believed, unexplained = belief.believed, belief.unexplained
    return BeliefOverTime(inference.name, families, decisions, readings, believed, doubts, notes, unexplained)


def save_beliefs(run: BeliefOverTime, path: Path) -> None:
    """A CSV with a row per decision: what was heard, empty where that is nothing, then what was believed."""
    decisions = run.decisions
    states = {COLUMNS[field]: values[1:] for field, values in decisions.fields.items()}
    unheard = np.isnan(decisions.reward)
    heard = {name: np.where(unheard, np.nan, values) for name, values in (states | {REWARD: decisions.reward}).items()}
    with written_whole(path) as unfinished, unfinished.open("w", newline="") as file:
        rows = [
            {TIME: run.time_s[i]} | {name: values[i] for name, values in heard.items()} | _row(reading, run.families)
            for i, reading in enumerate(run.readings)
        ]
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows({name: _plain(value) for name, value in row.items()} for row in rows)


def _row(reading: Reading, families: FamilySet) -> dict[str, Any]:
    names = ["inferred_target", *(f"inferred_target_{i}" for i in range(2, families.size + 1))]
    target = [*reading.target, *[math.nan] * (families.size - len(reading.target))]
    return {
        "inferred_family": reading.family,
        **dict(zip(names, target, strict=True)),
        **{f"probability_{family}": p for family, p in reading.probabilities.items()},
        **{f"cluster_{k}": share for k, share in reading.responsibilities.items()},
        **{f"latent_{i + 1}": value for i, value in enumerate(reading.latent.mean)},
    }


def _plain(value: Any) -> Any:
    if isinstance(value, str):
        return value
    return "" if math.isnan(value) else round(float(value), 6)
