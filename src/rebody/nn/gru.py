"""A gated recurrent unit (Cho et al. 2014) on any leading batch shape."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float, PRNGKeyArray

from rebody.types import AnyArray


class GRU(eqx.Module):
    """One cell: (hidden, input) -> hidden; hidden stays in [-1, 1]."""

    from_input: Float[AnyArray, "inputs gates"]
    from_hidden: Float[AnyArray, "units gates"]
    bias: Float[AnyArray, " gates"]
    candidate_bias: Float[AnyArray, " units"]

    def __init__(self, inputs: int, units: int, *, key: PRNGKeyArray):
        input_key, hidden_key = jax.random.split(key)
        bound = units**-0.5
        self.from_input = jax.random.uniform(input_key, (inputs, 3 * units), minval=-bound, maxval=bound)
        self.from_hidden = jax.random.uniform(hidden_key, (units, 3 * units), minval=-bound, maxval=bound)
        self.bias = jnp.zeros(3 * units)
        self.candidate_bias = jnp.zeros(units)

    @property
    def units(self) -> int:
        """Size of the hidden state."""
        return self.from_hidden.shape[0]

    def __call__(
        self, hidden: Float[AnyArray, "*batch units"], inputs: Float[AnyArray, "*batch inputs"]
    ) -> Float[AnyArray, "*batch units"]:
        """The next hidden state."""
        reset_in, update_in, candidate_in = jnp.split(inputs @ self.from_input + self.bias, 3, axis=-1)
        reset_h, update_h, candidate_h = jnp.split(hidden @ self.from_hidden, 3, axis=-1)
        reset = jax.nn.sigmoid(reset_in + reset_h)
        update = jax.nn.sigmoid(update_in + update_h)
        candidate = jnp.tanh(candidate_in + reset * (candidate_h + self.candidate_bias))
        return update * hidden + (1 - update) * candidate
