"""Gradient descent, many steps in one scan."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Float, Key

from rebody.types import Tree

Metrics = dict[str, Float[Array, ""]]


def descend(
    model: Tree,
    memory: optax.OptState,
    optimiser: optax.GradientTransformation,
    loss: Callable[[Tree, Any], tuple[Float[Array, ""], Metrics]],
    keys: Key[Array, " step"],
) -> tuple[Tree, optax.OptState, Metrics]:
    """A step down the loss (model, key) -> (value, metrics) for each key.

    Returns the model, what the optimiser remembers, and the mean of each metric.
    """
    arrays, static = eqx.partition(model, eqx.is_array)

    def step(carry, key):
        arrays, memory = carry
        gradient, metrics = jax.grad(lambda a: loss(eqx.combine(a, static), key), has_aux=True)(arrays)
        updates, memory = optimiser.update(gradient, memory)
        return (eqx.apply_updates(arrays, updates), memory), metrics

    (arrays, memory), metrics = jax.lax.scan(step, (arrays, memory), keys)
    return eqx.combine(arrays, static), memory, jax.tree.map(jnp.mean, metrics)
