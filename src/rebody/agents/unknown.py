"""Rewards that no task which a module knows explains."""

from dataclasses import dataclass
from typing import Any

import equinox as eqx
from jaxtyping import Array, Float

from rebody.inference.any_law import LawMemory, SharpenedByAnyLaw

ENOUGH = 30
"""Rewards of a task before it is said that nothing explains them."""
LEAST_EXPLAINED = 0.5
"""Share of their variance below which rewards count as not explained."""


@dataclass(frozen=True)
class Explained:
    """How much of what was heard the likeliest known task explains."""

    share: float
    """Of the rewards' variance, in [0, 1]."""
    rewards: int
    """How many there were since the task became another one."""

    @property
    def is_unknown(self) -> bool:
        """Whether no known task explains them."""
        return self.rewards >= ENOUGH and self.share < LEAST_EXPLAINED

    @property
    def doubts(self) -> tuple[str, ...]:
        """A sentence where it is unknown."""
        if not self.is_unknown:
            return ()
        return (
            f"no task that the module knows explains the last {self.rewards} rewards: only {100 * self.share:.0f} % of "
            "their variance.",
        )


def explained(inferrer: Any, memory: Any) -> Explained | None:
    """By what an inferrer remembers of one body; None for all but those that hear any law."""
    if not isinstance(inferrer, SharpenedByAnyLaw):
        return None
    share, rewards = _share(inferrer, memory)
    return Explained(float(share), round(float(rewards)))


@eqx.filter_jit
def _share(inferrer: SharpenedByAnyLaw, memory: LawMemory) -> tuple[Float[Array, ""], Float[Array, ""]]:
    return inferrer.explained(memory), memory.heard.heard
