"""An input layer that lets a network be coarse and fine at once."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float, PRNGKeyArray

from rebody.types import AnyArray

SHARPNESS = (3.0, 12.0, 50.0)


class MultiScale(eqx.Module):
    """Appends learned projections of the input, squashed at three sharpnesses.

    A target 10 m away and one 3 cm away differ by a hundredth of an input's range: a plain MLP needs very
    many updates to be precise near zero, one that sees tanh(50 u) of a learned difference u few.
    """

    projection: Float[AnyArray, "inputs projections"]

    def __init__(self, inputs: int, projections: int, *, key: PRNGKeyArray):
        self.projection = jax.random.normal(key, (inputs, projections)) * inputs**-0.5

    @property
    def outputs(self) -> int:
        """Size of what it returns."""
        inputs, projections = self.projection.shape
        return inputs + len(SHARPNESS) * projections

    def __call__(self, x: Float[AnyArray, "*batch inputs"]) -> Float[AnyArray, "*batch outputs"]:
        """Inputs, then their squashed projections."""
        u = x @ self.projection
        return jnp.concatenate([x, *(jnp.tanh(sharpness * u) for sharpness in SHARPNESS)], axis=-1)
