"""A multilayer perceptron, with layer normalisation where a critic needs it."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float, PRNGKeyArray

from rebody.types import AnyArray


class MLP(eqx.Module):
    """Linear layers with SiLU between them; works on any leading batch shape.

    Plain matrix products on the whole batch rather than `vmap` of a vector network:
    XLA's CPU back end is fastest there.
    """

    weights: tuple[Float[AnyArray, "inputs outputs"], ...]
    biases: tuple[Float[AnyArray, " outputs"], ...]
    layer_norm: bool = eqx.field(static=True)

    def __init__(
        self,
        inputs: int,
        outputs: int,
        hidden: Sequence[int],
        *,
        key: PRNGKeyArray,
        layer_norm: bool = False,
        last_scale: float = 1.0,
    ):
        """`last_scale` shrinks the last layer, so that a policy starts near its mean action."""
        sizes = [inputs, *hidden, outputs]
        scales = [1.0] * len(hidden) + [last_scale]
        keys = jax.random.split(key, len(scales))
        self.weights = tuple(
            scale * jax.random.truncated_normal(k, -2.0, 2.0, (n, m)) * n**-0.5
            for k, n, m, scale in zip(keys, sizes[:-1], sizes[1:], scales, strict=True)
        )
        self.biases = tuple(jnp.zeros(m) for m in sizes[1:])
        self.layer_norm = layer_norm

    def __call__(self, x: Float[AnyArray, "*batch inputs"]) -> Float[AnyArray, "*batch outputs"]:
        """The last layer's outputs, unbounded."""
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            x = x @ weight + bias
            if self.layer_norm:
                x = _standardise(x)
            x = jax.nn.silu(x)
        return x @ self.weights[-1] + self.biases[-1]


def _standardise(x: Float[AnyArray, "*batch units"]) -> Float[AnyArray, "*batch units"]:
    centred = x - x.mean(-1, keepdims=True)
    return centred * jax.lax.rsqrt(jnp.mean(centred**2, -1, keepdims=True) + 1e-5)
