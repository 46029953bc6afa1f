"""Who chooses how long a subgoal is held."""

from abc import abstractmethod

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float, Int, PRNGKeyArray

from rebody.control.sac import Actor
from rebody.control.step_predictor import MOST_STEPS
from rebody.types import AnyArray


class Chooser(eqx.Module):
    """(what a predictor sees, random key) -> action in [-1, 1], see `steps_of`."""

    @abstractmethod
    def __call__(self, observation: Float[AnyArray, "robot feature"], key: PRNGKeyArray) -> Float[AnyArray, "robot 1"]:
        """One for each robot."""


class Exploring(Chooser):
    """Samples its actor: for training."""

    actor: Actor

    def __call__(self, observation, key):
        """A sample."""
        return self.actor.sample(observation, key)[0]


class Deciding(Chooser):
    """Takes its actor's most likely action: as it will be used."""

    actor: Actor

    def __call__(self, observation, key):
        """Nothing is left to chance."""
        return self.actor(observation)


class Fixed(Chooser):
    """Always says the same: a fixed stride, to compare with."""

    steps: Int[AnyArray, ""]

    def __call__(self, observation, key):
        """The middle of that number's share of actions."""
        return jnp.full((len(observation), 1), 2 * (self.steps - 0.5) / MOST_STEPS - 1)
