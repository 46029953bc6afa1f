"""The bridge's choice: which slot of the tracker a belief is about (thesis 5.6.2, 6.4)."""

from abc import abstractmethod

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float, Int

from rebody.inference.decoder import Decoder
from rebody.inference.mixture.padded import MixturePrior
from rebody.nn import MLP
from rebody.types import AnyArray, Belief

LIKELY = 0.75
"""Probability from which a family is acted on."""


class SlotChooser(eqx.Module):
    """Belief -> slot, an index into the families of the module."""

    @abstractmethod
    def __call__(self, belief: Belief) -> Int[AnyArray, "*batch"]:
        """The slot that is addressed."""


class OneSlot(SlotChooser):
    """For a module of one family there is nothing to choose."""

    family: int = eqx.field(static=True, default=0)

    def __call__(self, belief: Belief) -> Int[AnyArray, "*batch"]:
        """Always the same."""
        return jnp.full(belief.mean.shape[:-1], self.family)


class SlotClassifier(SlotChooser):
    """A logit per slot from the latent, learned with labels on the toy (thesis 6.4)."""

    net: MLP

    def logits(self, belief: Belief) -> Float[AnyArray, "*batch slot"]:
        """Of each family's slot."""
        return self.net(belief.mean)

    def __call__(self, belief: Belief) -> Int[AnyArray, "*batch"]:
        """The likeliest."""
        return jnp.argmax(self.logits(belief), axis=-1)


class SlotOfBelief(SlotChooser):
    """That of the family that the belief itself says is meant; no label is used."""

    decoder: Decoder

    def __call__(self, belief: Belief) -> Int[AnyArray, "*batch"]:
        """The likeliest, or the first where none is likely enough to act on: before anything is heard."""
        share = self.decoder.interpret(belief).mean[..., : len(self.decoder.experts)]
        return jnp.where(jnp.max(share, axis=-1) < LIKELY, 0, jnp.argmax(share, axis=-1))


class SlotOfCluster(SlotChooser):
    """The slot of the mixture's component that a belief belongs to, found on the toy without labels."""

    mixture: MixturePrior
    slots: Int[AnyArray, " K"]

    def __call__(self, belief: Belief) -> Int[AnyArray, "*batch"]:
        """That of the likeliest component."""
        return jnp.asarray(self.slots)[self.mixture.component(belief.mean)]
