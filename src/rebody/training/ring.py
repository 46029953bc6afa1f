"""A ring of transitions in host memory: a pytree of arrays with a row each, written in place."""

import jax
import numpy as np

from rebody.types import Tree


def write(ring: Tree, first: int, rows: Tree) -> None:
    """Write rows over the oldest ones; `first` counts all rows ever written before."""
    for old, new in zip(jax.tree.leaves(ring), jax.tree.leaves(rows), strict=True):
        old[(first + np.arange(len(new))) % len(old)] = new


def newest(ring: Tree, written: int, rows: int) -> Tree:
    """The last rows of which `written` were ever written."""
    return jax.tree.map(lambda leaf: leaf[(written - rows + np.arange(rows)) % len(leaf)], ring)


def draw(ring: Tree, written: int, shape: tuple[int, ...], rng: np.random.Generator) -> Tree:
    """Rows drawn evenly with replacement, of which `written` were ever written."""
    size = len(jax.tree.leaves(ring)[0])
    rows = rng.integers(min(size, written), size=shape)
    return jax.tree.map(lambda leaf: leaf[rows], ring)
