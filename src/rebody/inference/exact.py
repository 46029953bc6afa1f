"""The exact posterior over tasks on a grid: the yardstick for any learned inference (agent `bayes`).

It stands where an encoder stands: the same three methods, a memory carried from decision to decision.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from rebody.tasks import FamilySet
from rebody.types import AnyArray, Belief, Task, Transition

REWARD_STD = 0.01
"""Standard deviation of the reward's likelihood, in units of the reward."""
CHANGE_PROBABILITY = 1e-6
"""Chance per decision that the task has become another one."""
TARGETS = {1: 2001, 2: 101, 3: 21}
"""Grid points along each axis, by the number of axes of a family."""
FEW = 9
"""The same for more axes."""


class ExactPosterior(eqx.Module):
    """Bayes' rule on a grid of (family, target)."""

    grid: Task  # [point], those of small targets first
    families: FamilySet = eqx.field(static=True)

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
        family = jnp.broadcast_to(self.grid.family, memory.shape)
        grid = Task(family, jnp.broadcast_to(self.grid.target, (*memory.shape, self.families.size)))
        surprise = (transition.reward[..., None] - self.families.reward(grid, state)) / REWARD_STD
        uniform = jnp.log(CHANGE_PROBABILITY) + self.initial()
        changed = jnp.logaddexp(memory + jnp.log1p(-CHANGE_PROBABILITY), uniform)
        log_posterior = jax.nn.log_softmax(changed - 0.5 * surprise**2)
        return log_posterior, self.belief(log_posterior)

    def unheard(
        self, memory: Float[AnyArray, "*batch point"], transition: Transition
    ) -> Float[AnyArray, "*batch point"]:
        """A decision in which no reward was heard leaves no trace; the transition's reward means nothing."""
        return memory

    def belief(self, log_posterior: Float[AnyArray, "*batch point"]) -> Belief:
        """The most probable task, as (family, target ...); the variance is what is left of the probability."""
        mode = jnp.argmax(log_posterior, axis=-1)
        family = jnp.asarray(self.grid.family)[mode].astype(jnp.float32)
        mean = jnp.concatenate([family[..., None], jnp.asarray(self.grid.target)[mode]], axis=-1)
        doubt = 1 - jnp.exp(jnp.max(log_posterior, axis=-1))
        return Belief(mean, jnp.broadcast_to(doubt[..., None], mean.shape))


def read_mode(belief: Belief) -> tuple[Int[AnyArray, "*batch"], Float[AnyArray, "*batch axis"]]:
    """Family and target of an exact posterior's belief."""
    return jnp.round(belief.mean[..., 0]).astype(jnp.int32), belief.mean[..., 1:]


def exact_posterior(families: FamilySet) -> ExactPosterior:
    """A flat prior over evenly spaced targets between the ends of each family's range."""
    grids = []
    for each in families:
        ends, points = each.range, TARGETS.get(each.size, FEW)
        axes = [np.linspace(low, high, points) for low, high in zip(ends.low, ends.high, strict=True)]
        grids.append(families.pad(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, each.size)))
    family = np.repeat(np.arange(len(families), dtype=np.int32), [len(grid) for grid in grids])
    target = np.concatenate(grids)
    nearest_first = np.argsort(np.linalg.norm(target, axis=-1), kind="stable")  # a tie goes to what asks least
    return ExactPosterior(Task(family[nearest_first], target[nearest_first].astype(np.float32)), families)
