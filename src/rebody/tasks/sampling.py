"""Drawing tasks: the base task uniformly (thesis 6.2), then its target uniformly (6.3)."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PRNGKeyArray

from rebody.ranges import Finite
from rebody.tasks.families import family_index
from rebody.types import Task


@dataclass(frozen=True)
class BaseTask:
    """A family with one range of targets; the thesis counts front and back as two."""

    family: str
    low: Finite
    high: Finite


@dataclass(frozen=True)
class TaskDistribution:
    """Base tasks of equal probability."""

    base_tasks: tuple[BaseTask, ...]

    @property
    def families(self) -> tuple[int, ...]:
        """Indices of the families that occur, ascending."""
        return tuple(sorted({family_index(task.family) for task in self.base_tasks}))

    def target_range(self, family: str) -> tuple[float, float]:
        """Smallest and largest target of a family over its base tasks."""
        ranges = [(task.low, task.high) for task in self.base_tasks if task.family == family]
        return min(low for low, _ in ranges), max(high for _, high in ranges)

    def sample(self, key: PRNGKeyArray, shape: tuple[int, ...]) -> Task:
        """Tasks of the given batch shape."""
        which_key, where_key = jax.random.split(key)
        which = jax.random.randint(which_key, shape, 0, len(self.base_tasks))
        family = jnp.asarray([family_index(task.family) for task in self.base_tasks])[which]
        low = jnp.asarray([task.low for task in self.base_tasks])[which]
        high = jnp.asarray([task.high for task in self.base_tasks])[which]
        return Task(family, low + (high - low) * jax.random.uniform(where_key, shape))

    def draw(self, rng: np.random.Generator) -> Task:
        """One task from NumPy's generator, which no setting of JAX changes."""
        base_task = self.base_tasks[rng.integers(len(self.base_tasks))]
        target = rng.uniform(base_task.low, base_task.high)
        return Task(np.asarray(family_index(base_task.family)), np.asarray(target))

    def sample_episodes(self, key: PRNGKeyArray, episodes: int, decisions: int, switch_share: float) -> Task:
        """The active tasks of episodes, [episode, decision]: a share of them changes once, at any decision."""
        first_key, second_key, switches_key, when_key = jax.random.split(key, 4)
        first, second = self.sample(first_key, (episodes,)), self.sample(second_key, (episodes,))
        begins = jax.random.randint(when_key, (episodes,), 1, decisions)
        begins = jnp.where(jax.random.bernoulli(switches_key, switch_share, (episodes,)), begins, decisions)
        has_switched = jnp.arange(decisions) >= begins[:, None]
        return jax.tree.map(lambda a, b: jnp.where(has_switched, b[:, None], a[:, None]), first, second)
