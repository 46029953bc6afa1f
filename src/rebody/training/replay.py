"""Replay buffers: rows in host memory, or groups of episodes on the device."""

from typing import Generic

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Int

from rebody.types import Tree


class Replay(eqx.Module, Generic[Tree]):
    """Rows of a pytree in host memory, written in place; the newest replace the oldest."""

    rows: Tree
    written: Int[np.ndarray, ""]  # rows ever

    @classmethod
    def empty(cls, size: int, like: Tree) -> "Replay[Tree]":
        """Room for so many rows such as those of `like`."""
        rows = jax.tree.map(lambda leaf: np.zeros((size, *leaf.shape[1:]), leaf.dtype), like)
        return cls(rows, np.zeros((), np.int64))

    def append(self, rows: Tree) -> None:
        """Write rows over the oldest ones."""
        for old, new in zip(jax.tree.leaves(self.rows), jax.tree.leaves(rows), strict=True):
            old[(int(self.written) + np.arange(len(new))) % len(old)] = new
        self.written[...] += len(jax.tree.leaves(rows)[0])

    def newest(self, count: int) -> Tree:
        """The last rows."""
        first = int(self.written) - count
        return jax.tree.map(lambda leaf: leaf[(first + np.arange(count)) % len(leaf)], self.rows)

    def draw(self, shape: tuple[int, ...], rng: np.random.Generator) -> Tree:
        """Rows drawn evenly with replacement."""
        stored = min(len(jax.tree.leaves(self.rows)[0]), int(self.written))
        chosen = rng.integers(stored, size=shape)
        return jax.tree.map(lambda leaf: leaf[chosen], self.rows)


@eqx.filter_jit
def store_group(groups: Tree, group: Tree, iteration: Int[Array, ""]) -> tuple[Tree, Int[Array, ""]]:
    """Groups on the device with a new one in place of the oldest, and how many of them are filled."""
    size = len(jax.tree.leaves(groups)[0])
    groups = jax.tree.map(lambda old, new: old.at[iteration % size].set(new), groups, group)
    return groups, jnp.minimum(iteration + 1, size)
