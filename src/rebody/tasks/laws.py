"""Reward laws: what is paid for a distance from a target. A new law is one entry here, or in a file of a user's own."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np

from rebody.errors import RebodyError, unknown
from rebody.tasks.quantities import length

Measure = Literal["l2", "l1", "along"]
"""How far it is from a target: the length of the error, the sum of its absolute numbers, or how little lies along the
target's direction, minus what does."""


@dataclass(frozen=True)
class RewardLaw:
    """What is paid for a distance; no control cost, no alive bonus, and never more for a larger distance."""

    name: str
    formula: str
    """In messages."""
    pay: Callable[[Any, Any], Any]
    """(distance, scale) -> reward, of arrays [...]; the scale is max(|target|, the family's floor)."""
    source: str = ""
    """SHA-256 of the file that it comes from; none for those of the package."""
    measure: Measure = "l2"
    """Which distance."""

    def distance(self, error: Any, target: Any) -> Any:
        """Of errors, what is reached minus the target, [*batch, number] both."""
        xp = jnp if isinstance(error, jax.Array) else np
        if self.measure == "l1":
            return xp.sum(xp.abs(error), axis=-1)
        if self.measure == "along":
            towards = target / xp.maximum(length(target), 1e-9)[..., None]
            return -xp.sum((error + target) * towards, axis=-1)
        return length(error)


LAWS = {
    law.name: law
    for law in (
        RewardLaw("plain", "-|error|", lambda distance, scale: -distance),
        RewardLaw("relative", "-|error| / max(|target|, floor)", lambda distance, scale: -distance / scale),
    )
}
"""By name, which is what families and artifacts say; `rebody.tasks.family_file` adds a user's own."""


def add_law(law: RewardLaw) -> None:
    """Make a user's own law known under its name; RebodyError where another one has it."""
    if LAWS.setdefault(law.name, law).source != law.source:
        raise RebodyError(f"a reward law '{law.name}' is known already; choose another name.")


def law_named(name: str) -> RewardLaw:
    """RebodyError if there is none of that name."""
    if name in LAWS:
        return LAWS[name]
    raise unknown("law", name, LAWS, "those of your own file, named by --families FILE")
