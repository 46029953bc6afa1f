"""The exact posterior over tasks on a grid: the yardstick for any learned inference (agent `bayes`).

It stands where an encoder stands: the same three methods, a memory carried from decision to decision.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from rebody.tasks import RewardForm, family_index, reward
from rebody.types import AnyArray, Belief, Task, Transition

REWARD_STD = 0.01
"""Standard deviation of the reward's likelihood, in units of the reward."""
CHANGE_PROBABILITY = 1e-6
"""Chance per decision that the task has become another one."""
TARGETS = 2001
"""Grid points per family."""


class ExactPosterior(eqx.Module):
    """Bayes' rule on a grid of (family, target)."""

    grid: Task  # [point], those of small targets first
    form: RewardForm = eqx.field(static=True)

    def initial(self, shape: tuple[int, ...] = ()) -> Float[Array, "*batch point"]:
        """Log-probabilities before anything is seen: all tasks alike."""
        return jnp.full((*shape, len(self.grid.target)), -jnp.log(len(self.grid.target)))

    def prior(self, shape: tuple[int, ...] = ()) -> Belief:
        """The belief before anything is seen."""
        one = self.belief(self.initial())
        return jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, (*shape, *leaf.shape)), one)

    def step(
        self, memory: Float[AnyArray, "*batch point"], transition: Transition
    ) -> tuple[Float[Array, "*batch point"], Belief]:
        """Take in a transition: its reward is all that tells. The memory holds log-probabilities."""
        state = jax.tree.map(lambda field: field[..., None], transition.state)
        grid = jax.tree.map(lambda field: jnp.broadcast_to(field, memory.shape), self.grid)
        surprise = (transition.reward[..., None] - reward(grid, state, self.form)) / REWARD_STD
        uniform = jnp.log(CHANGE_PROBABILITY) + self.initial()
        changed = jnp.logaddexp(memory + jnp.log1p(-CHANGE_PROBABILITY), uniform)
        log_posterior = jax.nn.log_softmax(changed - 0.5 * surprise**2)
        return log_posterior, self.belief(log_posterior)

    def belief(self, log_posterior: Float[AnyArray, "*batch point"]) -> Belief:
        """The most probable task, as (family, target); the variance is what is left of the probability."""
        mode = jnp.argmax(log_posterior, axis=-1)
        mean = jnp.stack([self.grid.family[mode].astype(jnp.float32), self.grid.target[mode]], axis=-1)
        doubt = 1 - jnp.exp(jnp.max(log_posterior, axis=-1))
        return Belief(mean, jnp.stack([doubt, doubt], axis=-1))


def read_mode(belief: Belief) -> tuple[Int[AnyArray, "*batch"], Float[AnyArray, "*batch"]]:
    """Family and target of an exact posterior's belief."""
    return jnp.round(belief.mean[..., 0]).astype(jnp.int32), belief.mean[..., 1]


def exact_posterior(target_ranges: dict[str, tuple[float, float]], form: RewardForm) -> ExactPosterior:
    """A flat prior over evenly spaced targets of each family."""
    family = np.repeat([family_index(name) for name in target_ranges], TARGETS).astype(np.int32)
    target = np.concatenate([np.linspace(low, high, TARGETS) for low, high in target_ranges.values()])
    nearest_first = np.argsort(np.abs(target), kind="stable")  # a tie goes to the task that asks least
    return ExactPosterior(Task(family[nearest_first], target[nearest_first].astype(np.float32)), form)
