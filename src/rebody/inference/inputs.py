"""How fields of a global state enter networks: scaled, a heading as sine and cosine."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from rebody.tasks.quantities import wrapped_where
from rebody.types import ANGLES, DECISION_DT, AnyArray, GlobalState

CIRCULAR = ("yaw",)
"""Angles without a rest: any is as good as any other. Pitch and roll are told from rest, and what turns over fell."""


def inputs_of(fields: tuple[str, ...]) -> int:
    """How many numbers fields enter as."""
    return len(fields) + sum(field in CIRCULAR for field in fields)


def scaled(state: GlobalState, fields: tuple[str, ...], scales: tuple[float, ...]) -> Float[AnyArray, "*batch field"]:
    """Each field divided by its scale."""
    return state.select(fields) / jnp.asarray(scales)


def seen(values: Float[AnyArray, "*batch field"], fields: tuple[str, ...], scales: tuple[float, ...]):
    """Scaled fields as networks see them, [*batch, input]."""
    if not set(fields) & set(CIRCULAR):
        return values
    columns = []
    for i, (field, scale) in enumerate(zip(fields, scales, strict=True)):
        value = values[..., i]
        columns += [jnp.sin(scale * value), jnp.cos(scale * value)] if field in CIRCULAR else [value]
    return jnp.stack(columns, axis=-1)


def apart(a, b, fields: tuple[str, ...], scales: tuple[float, ...]) -> Float[AnyArray, "*batch field"]:
    """a - b of scaled fields; angles the shorter way round."""
    return wrapped_where(tuple(field in ANGLES for field in fields), a - b, np.array(scales, np.float32))


def rates(now, before, fields: tuple[str, ...], scales: tuple[float, ...]) -> Float[AnyArray, "*batch field"]:
    """What scaled fields changed by in a decision, per second."""
    return apart(now, before, fields, scales) / DECISION_DT
