"""What a belief says itself, by the decoder: which family, and where its quantity is to be brought."""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from rebody.inference.decoder import Decoder
from rebody.tasks import FamilySet
from rebody.types import AnyArray, Belief


class PlaceReader(eqx.Module):
    """Reads as a `Probe` does, for modules with an expert for each family."""

    decoder: Decoder
    families: FamilySet = eqx.field(static=True)

    def __call__(self, belief: Belief) -> tuple[Int[Array, "*batch"], Float[Array, "*batch axis"]]:
        """Family (its index in `families`) and target [m, m/s, rad] of each belief."""
        which = jnp.argmax(self.probabilities(belief), axis=-1)
        of_each = [self.families.pad(mean) for mean, _ in self.spreads(belief)]
        targets = jnp.take_along_axis(jnp.stack(of_each, axis=-2), which[..., None, None], axis=-2)[..., 0, :]
        return which, targets

    def probabilities(self, belief: Belief) -> Float[AnyArray, "*batch family"]:
        """Of each family."""
        return self._understood(belief).mean[..., : len(self.families)]

    def spreads(self, belief: Belief) -> list[tuple[Float[AnyArray, "*batch _"], Float[AnyArray, "*batch _"]]]:
        """Of each family, were it the one: mean and standard deviation of its target."""
        understood, known = self._understood(belief), len(self.families)
        means, deviations = (
            self._split(understood.mean[..., known:]),
            self._split(understood.variance[..., known:] ** 0.5),
        )
        return [
            (mean * np.array(expert.scales), deviation * np.array(expert.scales))
            for expert, mean, deviation in zip(self.decoder.experts, means, deviations, strict=True)
        ]

    def _understood(self, belief: Belief) -> Belief:
        """Shares of the families, then their places; a module that is not split knows one family."""
        if self.decoder.choice is not None:
            return self.decoder.interpret(belief)
        (expert,) = self.decoder.experts
        share = jnp.ones((*belief.mean.shape[:-1], 1))
        return Belief(
            jnp.concatenate([share, expert.place(belief.mean)], axis=-1),
            jnp.concatenate([jnp.zeros_like(share), expert.doubt(belief)], axis=-1),
        )

    def _split(self, numbers: Float[AnyArray, "*batch number"]) -> Sequence[Float[AnyArray, "*batch _"]]:
        return jnp.split(numbers, np.cumsum([family.size for family in self.families])[:-1], axis=-1)
