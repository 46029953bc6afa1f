"""Rewards that no task could have paid: said, and not believed."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from rebody.inference.contract import Contract
from rebody.tasks import Quantity
from rebody.tasks.bounds import payable
from rebody.types import DECISION_DT, GlobalState

SLACK, TOLERANCE = 1.25, 0.01
"""Rewards may lie beyond a bound by this factor and, in the reward's unit, by that much: they are averaged over other
moments than states are."""
STUCK = 10
"""Decisions of one and the same reward, while the body moved, after which it counts as stuck."""
RECENT_S = 3.2
"""How long a doubt is kept up by default [s]: as long as a belief rests on what was heard."""

Ends = tuple[Float[np.ndarray, " _"], Float[np.ndarray, " _"]]
"""Between which a quantity was meanwhile; each family's has a size of its own."""


@dataclass
class _Seen:
    """How often something was seen, with which rewards, beside which bounds, and when last."""

    times: int = 0
    lowest: float = 0.0
    highest: float = 0.0
    bounds: tuple[float, float] = (0.0, 0.0)
    last: int = -1

    def add(self, decision: int, reward: float, bounds: tuple[float, float]) -> None:
        self.lowest = min(self.lowest, reward) if self.times else reward
        self.highest = max(self.highest, reward) if self.times else reward
        self.times, self.bounds, self.last = self.times + 1, bounds, decision

    @property
    def says(self) -> str:
        span = " to ".join(dict.fromkeys((f"{self.lowest:.3g}", f"{self.highest:.3g}")))
        return f"the reward was {span} in {self.times} decision{'s' if self.times > 1 else ''}"


class RewardWatch:
    """Holds each reward against what the tasks of a module could pay in the states before and after it.

    A module that hears any law can be paid anything: there all is believed (`rebody.agents.unknown` says what no task
    explains).
    """

    def __init__(self, contract: Contract):
        self._contract = contract
        self._families = contract.families
        self._impossible, self._untrained, self._stuck = _Seen(), _Seen(), _Seen()
        self._decisions, self._same = 0, 0
        self._last_reward: float | None = None

    def hear(self, previous: GlobalState, state: GlobalState, reward: float) -> bool:
        """Whether a reward can be believed: some target of some family could have paid it, and it is not stuck."""
        self._decisions += 1
        if self._contract.any_law:
            return True
        moved = [_moved(family.quantity, previous, state) for family in self._families]
        self._count_same(reward, all(np.any(before != after) for before, after in moved))
        bounds = self._bounds(moved, trained=False)
        if _is_beyond(reward, bounds):
            self._impossible.add(self._decisions, reward, bounds)
            return False
        if self._same >= STUCK:
            self._stuck.add(self._decisions, reward, bounds)
            return False
        if _is_beyond(reward, bounds := self._bounds(moved, trained=True)):
            self._untrained.add(self._decisions, reward, bounds)
        return True

    def pass_over(self) -> None:
        """A decision before which nothing was heard."""
        self._decisions += 1

    def doubts(self, within_s: float = RECENT_S) -> tuple[str, ...]:
        """Sentences about rewards of the last seconds that were not believed; none where all is plausible."""
        worst, best = self._impossible.bounds
        laws = " or ".join(dict.fromkeys(family.reward_law.formula for family in self._families))
        beyond = (
            f"{self._impossible.says}, which no target of {self._names} pays there (at the last one {worst:.3g} to "
            f"{best:.3g}); it was not believed. The module expects {laws}, without bonuses, costs or another scale."
        )
        stuck = (
            f"{self._stuck.says}, the same to the last digit, though the body moved; it was not believed. "
            "Is the reward filled in?"
        )
        said = ((self._impossible, beyond), (self._stuck, stuck))
        return tuple(text for seen, text in said if self._is_recent(seen, within_s))

    def notes(self, within_s: float = RECENT_S) -> tuple[str, ...]:
        """Sentences about rewards that were believed, though no target of the training would have paid them."""
        worst, best = self._untrained.bounds
        text = (
            f"{self._untrained.says}, which no target that the module learned pays there (at the last one {worst:.3g} "
            f"to {best:.3g}): is the task outside of its ranges?"
        )
        return (text,) if self._is_recent(self._untrained, within_s) else ()

    @property
    def _names(self) -> str:
        return " or ".join(family.name for family in self._families)

    def _is_recent(self, seen: _Seen, within_s: float) -> bool:
        return seen.times > 0 and (self._decisions - seen.last) * DECISION_DT < within_s

    def _count_same(self, reward: float, has_moved: bool) -> None:
        is_same = self._last_reward is not None and math.isclose(reward, self._last_reward, rel_tol=1e-9)
        self._same = self._same + 1 if is_same and has_moved else 1
        self._last_reward = reward

    def _bounds(self, moved: list[Ends], *, trained: bool) -> tuple[float, float]:
        """Over all families, by the targets that the module was trained on, or by any."""
        of_each = [
            payable(family, ends, family.range if trained else None)
            for family, ends in zip(self._families, moved, strict=True)
        ]
        return min(worst for worst, _ in of_each), max(best for _, best in of_each)


def _moved(quantity: Quantity, previous: GlobalState, state: GlobalState) -> Ends:
    before, after = (np.asarray(quantity.read(each), float).reshape(-1, quantity.size)[0] for each in (previous, state))
    return before, after


def _is_beyond(reward: float, bounds: tuple[float, float]) -> bool:
    worst, best = bounds
    lowest, highest = min(SLACK * worst, worst / SLACK), max(SLACK * best, best / SLACK)
    return not lowest - TOLERANCE <= reward <= highest + TOLERANCE
