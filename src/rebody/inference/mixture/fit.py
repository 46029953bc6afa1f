"""Laps over batches: memoized variational inference, with the moves that change the number of components.

Every batch keeps the responsibilities and statistics that it was last given, so the whole data's statistics, and
with them the ELBO, are exact at any moment, and no step lets it fall.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int

from rebody.inference.mixture.model import Model, Parameters, Responsibilities
from rebody.inference.mixture.statistics import Statistics, combine, concatenate, stack

EPSILON = 1e-6
"""A move must gain more than this [nats]."""


@dataclass(frozen=True)
class Known:
    """What a finished fit leaves to the next."""

    parameters: Parameters
    ids: Int[np.ndarray, " K"]  # last for life
    next_id: int


@dataclass
class Fit:
    """A mixture on its way: batches, what each was last given, and who the components are."""

    model: Model
    batches: list[Float[np.ndarray, "_ D"]]
    responsibilities: list[Responsibilities]
    statistics: Statistics  # [batch, K]
    ids: Int[np.ndarray, " K"]
    next_id: int
    homes: dict[int, Float[np.ndarray, " D"]] = field(default_factory=dict)  # where components lay before this fit
    total: Statistics = field(init=False)  # [K]
    parameters: Parameters = field(init=False)
    bound: float = field(init=False)

    def __post_init__(self):
        self.refresh()

    @property
    def k(self) -> int:
        """Components."""
        return len(self.ids)

    @property
    def known(self) -> Known:
        """For a warm start."""
        return Known(self.parameters, self.ids, self.next_id)

    def refresh(self) -> None:
        """Global step on the statistics of all batches."""
        self.total = combine(self.statistics)
        self.parameters = self.model.global_step(self.total)
        self.bound = self.model.bound(self.total)

    def visit(self, b: int) -> None:
        """Local step and summary of one batch, then the global step."""
        x = self.batches[b]
        self.responsibilities[b] = self.model.local_step(x, self.parameters)
        fresh = self.model.summarise(x, self.responsibilities[b])
        for old, new in zip(vars(self.statistics).values(), vars(fresh).values(), strict=True):
            old[b] = new
        self.refresh()

    def replace(self, columns: Int[np.ndarray, " kept"], added: "Columns", ids: Int[np.ndarray, " K"]) -> None:
        """Keep some components, and put new ones behind them."""
        for b, responsibilities in enumerate(self.responsibilities):
            r = np.concatenate([responsibilities.r[:, columns], added.r[b]], 1)
            entropy = np.concatenate([responsibilities.entropy[columns], added.statistics.entropy[b]])
            self.responsibilities[b] = Responsibilities(r, entropy)
        self.statistics = concatenate([self.statistics[:, columns], added.statistics], 1)
        self.ids = ids
        self.refresh()


@dataclass(frozen=True)
class Columns:
    """Components of a proposal: responsibilities in each batch, and their statistics."""

    r: list[Float[np.ndarray, "_ J"]]
    statistics: Statistics  # [batch, J]


def begin(model: Model, batches: list[Float[np.ndarray, "_ D"]], parts: list[Int[np.ndarray, " _"]]) -> Fit:
    """Components that hold their points for sure: those of part 0, of part 1, ..."""
    k = max(int(part.max()) for part in parts) + 1
    sure = [(part[:, None] == np.arange(k)).astype(float) for part in parts]
    return _fit(model, batches, [Responsibilities(r, np.zeros(k)) for r in sure], np.arange(k), k)


def begin_from(model: Model, batches: list[Float[np.ndarray, "_ D"]], known: Known) -> Fit:
    """A warm start: what was learned before gives every batch its first responsibilities."""
    responsibilities = [model.local_step(x, known.parameters) for x in batches]
    fit = _fit(model, batches, responsibilities, known.ids.copy(), known.next_id)
    fit.homes = dict(zip(known.ids.tolist(), known.parameters.components.mean, strict=True))
    return fit


def _fit(model, batches, responsibilities, ids, next_id) -> Fit:
    statistics = stack([model.summarise(x, r) for x, r in zip(batches, responsibilities, strict=True)])
    return Fit(model, batches, responsibilities, statistics, ids, next_id)
