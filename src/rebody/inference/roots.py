"""Triangular roots of small information matrices, R of QR: R^T R = J^T J for the slopes J of errors.

As in a square-root information filter (Bierman 1977): float32 loses the small directions of the information itself once
it has gathered much in another one. Loops over columns are unrolled: there are few, and a call of LAPACK for each of
many bodies costs more than all the arithmetic.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from rebody.types import AnyArray

TINY = 1e-20


def root_of(*slopes: Float[AnyArray, "_ amount"]) -> Float[Array, "amount amount"]:
    """The upper triangular root of the information of all these errors, by modified Gram-Schmidt."""
    left = jnp.concatenate(slopes)
    rows = []
    for i in range(left.shape[-1]):
        size = jnp.sqrt(jnp.sum(left[:, i] ** 2))
        along = left[:, i] / jnp.maximum(size, TINY)
        row = jnp.where(jnp.arange(left.shape[-1]) < i, 0.0, along @ left)
        rows.append(row.at[i].set(size))
        left = left - along[:, None] * row
    return jnp.stack(rows)


def solved(root: Float[AnyArray, "amount amount"], vector: Float[AnyArray, " amount"]) -> Float[Array, " amount"]:
    """x of R^T R x = vector; the root must have no 0 on its diagonal."""
    half, x = _half_solved(root, vector), []
    for i in reversed(range(root.shape[-1])):
        x.insert(0, (half[i] - sum(root[i, i + 1 + k] * later for k, later in enumerate(x))) / root[i, i])
    return jnp.stack(x)


def variance_along(
    root: Float[AnyArray, "amount amount"], slopes: Float[AnyArray, "number amount"]
) -> Float[Array, " number"]:
    """Variances of numbers that change with the amounts by these slopes; never negative, whatever is rounded."""
    return jnp.stack([jnp.sum(jnp.stack(_half_solved(root, slope)) ** 2) for slope in slopes])


def _half_solved(root: Float[AnyArray, "amount amount"], vector: Float[AnyArray, " amount"]) -> list[Array]:
    """y of R^T y = vector."""
    half: list[Array] = []
    for i in range(root.shape[-1]):
        half.append((vector[i] - sum(root[k, i] * half[k] for k in range(i))) / root[i, i])
    return half


def log_determinant(root: Float[AnyArray, "amount amount"]) -> Float[Array, ""]:
    """Of the information."""
    return 2 * jnp.sum(jnp.log(jnp.maximum(jnp.diagonal(root), TINY)))
