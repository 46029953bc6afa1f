"""A fit from its start to its end: laps of local steps, merges, births and deletes."""

from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from rebody.inference.mixture.fit import Fit, Known
from rebody.inference.mixture.moves import birth, delete, merge

MAX_LAPS = 500
TOLERANCE = 1e-8
"""A fit has settled when a lap without moves gains less than this share of the ELBO."""
ATTEMPTS = 2
"""Vain attempts at a birth or a delete of a component after which it is left alone until its size changes."""
CHANGED = 0.02
"""Share by which a component's size must change to be tried again."""


@dataclass(frozen=True)
class Lap:
    """What one lap came to."""

    bound: float  # ELBO [nats]
    components: int
    births: int
    merges: int
    deletes: int
    known: Known


class Trials:
    """Which components were tried in vain, and at what size."""

    def __init__(self):
        self._failed: dict[int, tuple[int, float]] = {}

    def worthwhile(self, identity: int, count: float) -> bool:
        """Whether a component of that size is worth another attempt."""
        times, size = self._failed.get(identity, (0, count))
        return times < ATTEMPTS or abs(count - size) > CHANGED * size + 1.0

    def failed(self, identity: int, count: float) -> None:
        """Note an attempt in vain."""
        times, size = self._failed.get(identity, (0, count))
        same = abs(count - size) <= CHANGED * size + 1.0
        self._failed[identity] = (times + 1 if same else 1, size if same else count)


@threadpool_limits.wrap(limits=1, user_api="blas")  # its matrices are small: threads would only wait for one another
def run(fit: Fit, rng: np.random.Generator, *, moves: bool = True) -> tuple[Fit, list[Lap]]:
    """Laps until nothing gains any more; the ELBO never falls. Without moves the number of components stays."""
    history, births, deletes = [], Trials(), Trials()
    for _ in range(MAX_LAPS):
        before = fit.bound
        for b in rng.permutation(len(fit.batches)).tolist():
            fit.visit(b)
        merged = merge(fit) if moves else 0
        born, tried = _births(fit, births, rng) if moves else (0, False)
        deleted = _delete(fit, deletes) if moves and not born else 0
        history.append(Lap(fit.bound, fit.k, born, merged, deleted, fit.known))
        settled = fit.bound - before <= TOLERANCE * abs(fit.bound)
        if settled and not tried and not (merged or born or deleted):
            break
    return fit, history


def _births(fit: Fit, trials: Trials, rng: np.random.Generator) -> tuple[int, bool]:
    """Try each component that may have parts, the largest first; returns how many had, and whether any was tried."""
    born = 0
    todo = [i for i in fit.ids[np.argsort(-fit.total.count)].tolist() if trials.worthwhile(i, _count(fit, i))]
    for identity in todo:
        k = int(np.flatnonzero(fit.ids == identity)[0])
        if birth(fit, k, rng):
            born += 1
        else:
            trials.failed(identity, _count(fit, identity))
    return born, bool(todo)


def _delete(fit: Fit, trials: Trials) -> int:
    """Try the smallest component that was not tried before."""
    for k in np.argsort(fit.total.count):
        identity, count = int(fit.ids[k]), float(fit.total.count[k])
        if trials.worthwhile(identity, count):
            if delete(fit, int(k)):
                return 1
            trials.failed(identity, count)
            return 0
    return 0


def _count(fit: Fit, identity: int) -> float:
    return float(fit.total.count[fit.ids == identity][0])
