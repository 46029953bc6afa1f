"""Which seeds a reset takes."""

import operator
from typing import Any

import numpy as np

from rebody.errors import RebodyError

BITS = 128
"""Of a seed at most: as many as NumPy draws where none is given, so `np_random_seed` may be given back."""


def body_seed(seed: Any) -> int | None:
    """A seed as Gymnasium takes it, None where a generator goes on; RebodyError for no whole number, or too large."""
    if seed is None:
        return None
    try:
        whole = -1 if isinstance(seed, bool) else operator.index(seed)
    except TypeError:
        whole = -1
    if not 0 <= whole < 2**BITS:
        raise RebodyError(f"a seed must be a whole number of at least 0 and less than 2^{BITS}, not {seed!r}.")
    return whole


def body_seeds(seed: Any, bodies: int) -> list[int | None]:
    """A seed of each body: `seed` + i, or entry i of a list, tuple or array, where None leaves a generator as it is.

    RebodyError as `body_seed`, or where there are not as many entries as bodies.
    """
    if isinstance(seed, list | tuple | range) or (isinstance(seed, np.ndarray) and seed.ndim > 0):
        if len(seed) != bodies:
            raise RebodyError(f"there are {len(seed)} seeds for {bodies} bodies; give one for each, or one integer.")
        return [body_seed(each) for each in seed]
    first = body_seed(seed)
    return [None if first is None else body_seed(first + body) for body in range(bodies)]
