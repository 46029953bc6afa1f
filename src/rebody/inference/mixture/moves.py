"""Moves that change the number of components; each is taken only if the ELBO gains by it."""

import numpy as np
import scipy.special
from jaxtyping import Float, Int

from rebody.inference.mixture.fit import EPSILON, Columns, Fit
from rebody.inference.mixture.model import Model, Responsibilities
from rebody.inference.mixture.statistics import Statistics, combine, concatenate, stack

SEEDS = 10
"""Components that a birth begins with."""
REFINEMENTS = 8
"""Steps that a birth is refined before it is tried."""
BELONGS = 0.1
"""A point takes part in a birth if the component has more than this share of it."""
SAMPLE = 3000
"""Points that a birth is designed on, at most."""
SMALLEST = 1.0
"""A component of a birth with fewer points is dropped."""


# merge


def merge(fit: Fit) -> int:
    """Merge pairs, the most gainful first, each component once; returns how many."""
    pairs = _candidates(fit)
    merged: set[int] = set()
    done = 0
    gains = sorted(((_merge_gain(fit, a, b), a, b) for a, b in pairs), reverse=True)
    columns = np.arange(fit.k)
    for gain, a, b in gains:
        if gain <= EPSILON:
            break
        if {a, b} & merged:
            continue
        here = [int(np.flatnonzero(columns == c)[0]) for c in (a, b)]
        before = fit.bound
        if _merge_pair(fit, *here, required=before + EPSILON):
            # the pair has become the last column
            columns = np.append(np.delete(columns, here), a)
            merged |= {a, b}
            done += 1
    return done


def _candidates(fit: Fit) -> list[tuple[int, int]]:
    """Pairs that could gain: entropy can only be lost by a merge, so the rest of the gain bounds it."""
    total, model = fit.total, fit.model
    base = model.allocation(total.count)
    return [
        (a, b)
        for a, b, gain in zip(*_pair_gains(model, total), strict=True)
        if gain + _allocation_merged(model, total.count, a, b) - base > EPSILON
    ]


def _pair_gains(model: Model, parts: Statistics) -> tuple[list[int], list[int], list[float]]:
    """All pairs (a, b), and what the evidence gains if each is merged [nats]."""
    a, b = np.triu_indices(len(parts.count), 1)
    evidence = model.gaussians.evidence(parts)
    together = model.gaussians.evidence(combine(parts[np.stack([a, b])]))
    return a.tolist(), b.tolist(), (together - evidence[a] - evidence[b]).tolist()


def _merge_gain(fit: Fit, a: int, b: int) -> float:
    """Exact gain of a merge [nats]."""
    total, model = fit.total, fit.model
    together = _sum_pair(total, a, b)
    evidence = model.gaussians.evidence(concatenate([together, total[[a, b]]], 0))
    allocation = _allocation_merged(model, total.count, a, b) - model.allocation(total.count)
    entropy = sum(_entropy(r.r[:, a] + r.r[:, b]) for r in fit.responsibilities)
    return float(evidence[0] - evidence[1] - evidence[2] + allocation + entropy - total.entropy[[a, b]].sum())


def _merge_pair(fit: Fit, a: int, b: int, required: float) -> bool:
    pair = [responsibilities.r[:, [a, b]].sum(1, keepdims=True) for responsibilities in fit.responsibilities]
    together = combine(Statistics(*(np.moveaxis(part[:, [a, b]], 1, 0) for part in vars(fit.statistics).values())))
    entropy = np.array([_entropy(r) for r in pair])
    statistics = Statistics(
        together.count[:, None], together.mean[:, None], together.scatter[:, None], entropy[:, None]
    )
    rest = np.delete(np.arange(fit.k), [a, b])
    survivor = max((a, b), key=lambda k: (int(fit.ids[k]) in fit.homes, fit.total.count[k]))  # who was there before
    return _try(fit, rest, Columns(pair, statistics), np.append(fit.ids[rest], fit.ids[survivor]), required)


def _sum_pair(statistics: Statistics, a: int, b: int) -> Statistics:
    return combine(statistics[[[a], [b]]])


def _allocation_merged(model: Model, count: Float[np.ndarray, " K"], a: int, b: int) -> float:
    return model.allocation(np.append(np.delete(count, [a, b]), count[a] + count[b]))


# birth


def birth(fit: Fit, k: int, rng: np.random.Generator) -> bool:
    """Split component k in two or more, if that gains."""
    design = _design(fit, k, rng)
    if design is None:
        return False
    columns = _apply(fit, k, design)
    rest = np.delete(np.arange(fit.k), k)
    fresh = fit.next_id + np.arange(columns.statistics.count.shape[1])
    fresh[_heir(fit, k, combine(columns.statistics))] = fit.ids[k]
    accepted = _try(fit, rest, columns, np.concatenate([fit.ids[rest], fresh]), fit.bound + EPSILON)
    if accepted:
        fit.next_id += columns.statistics.count.shape[1]
    return accepted


def _heir(fit: Fit, k: int, parts: Statistics) -> int:
    """The part that stays who the component was: that nearest to where it lay before this fit, else the largest."""
    home = fit.homes.get(int(fit.ids[k]))
    if home is None:
        return int(np.argmax(parts.count))
    return int(np.argmin(((parts.mean - home) ** 2).sum(-1)))


def _design(fit: Fit, k: int, rng: np.random.Generator) -> Statistics | None:
    """Statistics of the parts that component k might have, found on a sample of its points; None if it has one."""
    x, weight = _members(fit, k, rng)
    if len(x) < 2:
        return None
    model = fit.model
    centres = spread(model.gaussians.whiten(x, fit.parameters.components, k), weight, rng)
    parts = _parts(model, x, weight, (centres[:, None] == np.arange(centres.max() + 1)).astype(float))
    for _ in range(REFINEMENTS):
        parts = _parts(model, x, weight, _within(model, x, parts))
    parts = _merge_greedily(model, parts)
    return parts if len(parts.count) > 1 else None


def _parts(
    model: Model, x: Float[np.ndarray, "N D"], weight: Float[np.ndarray, " N"], share: Float[np.ndarray, "N J"]
) -> Statistics:
    """Statistics of the parts that are not too small; a design needs no entropy."""
    parts = model.summarise(x, Responsibilities(share * weight[:, None], np.zeros(share.shape[1])))
    return parts[parts.count >= min(SMALLEST, 0.5 * parts.count.max())]


def _members(fit: Fit, k: int, rng: np.random.Generator) -> tuple[Float[np.ndarray, "N D"], Float[np.ndarray, " N"]]:
    """Points of component k and their weights, which add up to its size also where only a sample is taken."""
    r = np.concatenate([responsibilities.r[:, k] for responsibilities in fit.responsibilities])
    rows = np.flatnonzero(r > BELONGS)
    taken = rng.choice(rows, SAMPLE, replace=False) if len(rows) > SAMPLE else rows
    taken = np.sort(taken)
    ends = np.cumsum([len(x) for x in fit.batches])
    of_batch = np.split(taken, np.searchsorted(taken, ends[:-1]))
    begins = ends - [len(x) for x in fit.batches]
    x = [batch[rows - begin] for batch, rows, begin in zip(fit.batches, of_batch, begins, strict=True)]
    return np.concatenate(x), r[taken] * (len(rows) / max(len(taken), 1))


def spread(
    x: Float[np.ndarray, "N D"], weight: Float[np.ndarray, " N"], rng: np.random.Generator, seeds: int = SEEDS
) -> Int[np.ndarray, " N"]:
    """k-means++: `seeds` points far from one another; returns the nearest of each point."""
    nearest, distance = np.zeros(len(x), int), np.full(len(x), np.inf)
    p = weight
    for seed in range(seeds):
        if not np.isfinite(p.sum()) or p.sum() <= 0:
            break
        chosen = x[rng.choice(len(x), p=p / p.sum())]
        to_seed = ((x - chosen) ** 2).sum(1)
        closer = to_seed < distance
        nearest[closer], distance = seed, np.minimum(distance, to_seed)
        p = weight * distance
    return np.unique(nearest, return_inverse=True)[1]


def _within(model: Model, x: Float[np.ndarray, "N D"], parts: Statistics) -> Float[np.ndarray, "N J"]:
    """How a component's points divide among its parts."""
    log_rho = model.gaussians.log_likelihood(x, model.gaussians.posterior(parts)) + np.log(parts.count + 1)
    return scipy.special.softmax(log_rho, axis=1)


def _merge_greedily(model: Model, parts: Statistics) -> Statistics:
    """Merge the pair that gains most while the evidence gains."""
    while len(parts.count) > 1:
        a, b, gains = _pair_gains(model, parts)
        best = int(np.argmax(gains))
        if gains[best] <= 0:
            return parts
        rest = np.delete(np.arange(len(parts.count)), [a[best], b[best]])
        parts = concatenate([parts[rest], _sum_pair(parts, a[best], b[best])], 0)
    return parts


def _apply(fit: Fit, k: int, parts: Statistics) -> Columns:
    """Divide component k's share of every point."""
    pairs = zip(fit.batches, fit.responsibilities, strict=True)
    return _columns(fit, [_within(fit.model, x, parts) * responsibilities.r[:, [k]] for x, responsibilities in pairs])


# delete


def delete(fit: Fit, k: int) -> bool:
    """Give component k's points to the others, if the ELBO does not fall."""
    if fit.k == 1:
        return False
    rest = np.delete(np.arange(fit.k), k)
    others = fit.model.global_step(fit.total[rest])
    shared = []
    for x, responsibilities in zip(fit.batches, fit.responsibilities, strict=True):
        r = responsibilities.r[:, rest]
        held = responsibilities.r[:, k]
        rows = np.flatnonzero(held > 0)
        r[rows] += held[rows, None] * fit.model.local_step(x[rows], others).r
        shared.append(r)
    return _try(fit, np.zeros(0, int), _columns(fit, shared), fit.ids[rest], fit.bound)


def _columns(fit: Fit, r: list[Float[np.ndarray, "_ J"]]) -> Columns:
    """Components that have these responsibilities in each batch."""
    statistics = []
    for x, share in zip(fit.batches, r, strict=True):
        entropy = scipy.special.entr(share).sum(0)
        statistics.append(fit.model.summarise(x, Responsibilities(share, entropy)))
    return Columns(r, stack(statistics))


def _try(fit: Fit, kept: Int[np.ndarray, " kept"], added: Columns, ids: Int[np.ndarray, " K"], required: float) -> bool:
    """Make a change if the ELBO then is at least `required`."""
    proposed = concatenate([fit.statistics[:, kept], added.statistics], 1)
    if not fit.model.bound(combine(proposed)) >= required:
        return False
    fit.replace(kept, added, ids)
    return True


def _entropy(r: Float[np.ndarray, "..."]) -> float:
    return float(scipy.special.entr(r).sum())
