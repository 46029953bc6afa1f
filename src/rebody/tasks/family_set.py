"""Families by name, in an order of their own: those of a module, of a tracker's commands, or of an evaluation."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int, PRNGKeyArray

from rebody.errors import unknown
from rebody.ranges import Box
from rebody.tasks.family import Family, Settle
from rebody.tasks.laws import RewardLaw, law_named
from rebody.tasks.quantities import length, wrapped_where
from rebody.types import AnyArray, GlobalState, Task


@dataclass(frozen=True)
class FamilySet:
    """Families under local indices; artifacts hold it whole, so an index means nothing outside of one set.

    Targets and values have an axis as long as the largest of the set, with zeros behind the size of a family.
    """

    families: tuple[Family, ...]

    def __post_init__(self):
        """ValueError where there is no family, or two of one name."""
        if not self.families or len(set(self.names)) < len(self.families):
            raise ValueError("families: there must be at least one, and none twice")

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash(self.families)  # asked for whenever a compiled function is called

    def __len__(self) -> int:
        return len(self.families)

    def __iter__(self) -> Iterator[Family]:
        return iter(self.families)

    def __getitem__(self, index: Any) -> Family:
        return self.families[int(index)]

    def __contains__(self, name: object) -> bool:
        return name in self.names

    @property
    def names(self) -> tuple[str, ...]:
        """In the order of their indices."""
        return tuple(family.name for family in self.families)

    @property
    def size(self) -> int:
        """Length of the axis of targets."""
        return max(family.size for family in self.families)

    @property
    def ranges(self) -> dict[str, Box]:
        """Between which ends the targets of each family lie."""
        return {family.name: family.range for family in self.families}

    def index(self, name: str) -> int:
        """RebodyError if there is no family of that name."""
        if name in self.names:
            return self.names.index(name)
        raise unknown("family", name, self.names)

    def named(self, name: str) -> Family:
        """RebodyError if there is none of that name."""
        return self.families[self.index(name)]

    def only(self, names: tuple[str, ...]) -> "FamilySet":
        """Those families, in this order."""
        return FamilySet(tuple(self.named(name) for name in names))

    def paid_by(self, law: str) -> "FamilySet":
        """The same, each paid by that law; RebodyError where there is none of that name."""
        return FamilySet(tuple(family.within(*family.targets, law=law_named(law).name) for family in self.families))

    def beside(self, others: "FamilySet") -> "FamilySet":
        """These, then those of the others whose names are new: indices stay what they are."""
        return FamilySet((*self.families, *(family for family in others if family.name not in self)))

    def pad(self, vector: Any) -> Float[AnyArray, "*batch axis"]:
        """Vectors [*batch, size] with zeros behind."""
        return fit(vector, self.size)

    def task(self, name: str, target: Any) -> Task:
        """One task; RebodyError where the target has another size than the family's."""
        family = self.named(name)
        return Task(np.asarray(self.index(name), np.int32), self.pad(np.asarray(family.admit(target))))

    def achieved(self, family: Int[AnyArray, "*batch"], state: GlobalState) -> Float[AnyArray, "*batch axis"]:
        """What of each state its family compares with a target, in the family's unit."""
        of_all = jnp.stack([self.pad(each.quantity.read(state)) for each in self.families], axis=-2)
        return jnp.take_along_axis(of_all, family[..., None, None], axis=-2)[..., 0, :]

    def achieved_by_way_of(
        self, family: Int[AnyArray, "*batch"], states: GlobalState
    ) -> Float[AnyArray, "*batch axis"]:
        """What states in a row, [time, *batch], lead to: the value of the last, or the largest on the way where a
        family is judged by that.
        """
        along = jax.vmap(lambda state: self.achieved(family, state))(states)
        is_largest = self.settles(family, "largest of 1 s")[..., None]
        return jnp.where(is_largest, along.max(axis=0), along[-1])

    def difference(
        self, family: Int[AnyArray, "*batch"], a: Float[AnyArray, "*batch axis"], b: Float[AnyArray, "*batch axis"]
    ) -> Float[AnyArray, "*batch axis"]:
        """a - b as each family's quantity has it."""
        difference = a - b
        if not any(any(each.quantity.wraps) for each in self.families):
            return difference
        of_each = jnp.stack([wrapped_where(_padded(each.quantity.wraps, self.size), difference) for each in self])
        return jnp.take_along_axis(of_each, family[None, ..., None], axis=0)[0]

    def error(self, task: Task, state: GlobalState) -> Float[AnyArray, "*batch axis"]:
        """What is achieved minus the target."""
        return self.difference(task.family, self.achieved(task.family, state), task.target)

    def reward(self, task: Task, state: GlobalState, law: RewardLaw | None = None) -> Float[AnyArray, "*batch"]:
        """Reward of the decision that led to `state`, by each family's law, or all by another one."""
        error, scale = self.error(task, state), self.scale(task)
        if law is not None:
            return law.pay(law.distance(error, task.target), scale)
        laws = dict.fromkeys(family.reward_law for family in self.families)
        paid = [each.pay(each.distance(error, task.target), scale) for each in laws]
        if len(paid) == 1:
            return paid[0]
        which = jnp.asarray([list(laws).index(family.reward_law) for family in self.families])[task.family]
        return jnp.select([which == i for i in range(len(paid))], paid)

    def scale(self, task: Task) -> Float[AnyArray, "*batch"]:
        """What relative distances are told in: the size of the target, or the family's floor."""
        floors = jnp.asarray([family.floor for family in self.families])
        return jnp.maximum(length(task.target), floors[task.family])

    def settles(self, family: Int[AnyArray, "*batch"], settle: Settle) -> Bool[AnyArray, "*batch"]:
        """Whether that is how each family judges."""
        return jnp.asarray([each.settle == settle for each in self.families])[family]

    def base_task(self, task: Task) -> Int[AnyArray, "*batch"]:
        """Family and direction as one index, of NumPy or JAX: the thesis counts front and back as two."""
        xp = jnp if isinstance(task.target, jax.Array) else np
        of_each = [first + each.direction(task.target[..., : each.size]) for first, each in self._first_base_tasks]
        which: Any = xp.asarray(task.family)[None]
        return xp.take_along_axis(xp.stack(of_each), which, axis=0)[0]

    @property
    def base_tasks(self) -> int:
        """How many there are."""
        return sum(len(family.direction_names) for family in self.families)

    @property
    def _first_base_tasks(self) -> list[tuple[int, Family]]:
        ends = np.cumsum([0, *(len(family.direction_names) for family in self.families)])
        return list(zip(ends.tolist(), self.families, strict=False))


def fit(vector: Any, size: int) -> Any:
    """Vectors [*batch, any] cut, or with zeros behind, to an axis of `size`."""
    if vector.shape[-1] >= size:
        return vector[..., :size]
    xp = jnp if isinstance(vector, jax.Array) else np
    return xp.concatenate([vector, xp.zeros((*vector.shape[:-1], size - vector.shape[-1]), vector.dtype)], axis=-1)


def sample(families: FamilySet, key: PRNGKeyArray, shape: tuple[int, ...]) -> Task:
    """Tasks of a batch shape: the base task uniformly (thesis 6.2), then its target uniformly (6.3)."""
    which_key, where_key = jax.random.split(key)
    family, low, high, polar = _base_tasks(families)
    which = jax.random.randint(which_key, shape, 0, len(family))
    share = jax.random.uniform(where_key, (*shape, families.size))
    drawn = jnp.asarray(low)[which] + jnp.asarray(high - low)[which] * share
    return Task(jnp.asarray(family)[which], _cartesian(drawn, jnp.asarray(polar)[which], jnp) if polar.any() else drawn)


def draw(families: FamilySet, rng: np.random.Generator) -> Task:
    """One task from NumPy's generator, which no setting of JAX changes."""
    family, low, high, polar = _base_tasks(families)
    which = rng.integers(len(family))
    drawn = rng.uniform(low[which].astype(float), high[which].astype(float))
    return Task(np.asarray(family[which]), _cartesian(drawn, polar[which], np) if polar.any() else drawn)


def sample_episodes(families: FamilySet, key: PRNGKeyArray, episodes: int, decisions: int, switch_share: float) -> Task:
    """The active tasks of episodes, [episode, decision]: a share of them changes once, at any decision."""
    first_key, second_key, switches_key, when_key = jax.random.split(key, 4)
    first, second = (sample(families, key, (episodes, 1)) for key in (first_key, second_key))
    begins = jax.random.randint(when_key, (episodes,), 1, decisions)
    begins = jnp.where(jax.random.bernoulli(switches_key, switch_share, (episodes,)), begins, decisions)
    has_switched = jnp.arange(decisions) >= begins[:, None]
    family = jnp.where(has_switched, second.family, first.family)
    return Task(family, jnp.where(has_switched[..., None], second.target, first.target))


def _cartesian(drawn: Any, polar: Any, xp: Any) -> Any:
    """Vectors [*batch, axis] of which those that are polar are a length and a bearing."""
    length, bearing = drawn[..., 0], drawn[..., 1]
    plane = fit(xp.stack([length * xp.cos(bearing), length * xp.sin(bearing)], axis=-1), drawn.shape[-1])
    return xp.where(polar[..., None], plane, drawn)


def _base_tasks(families: FamilySet) -> tuple[Int[np.ndarray, " base"], Any, Any, Bool[np.ndarray, " base"]]:
    """Family, the smallest and largest target, and whether these are polar, of every base task."""
    ranges = [(i, box) for i, family in enumerate(families) for box in family.targets]
    low, high = (
        np.stack([families.pad(np.asarray(getattr(box, end), np.float32)) for _, box in ranges])
        for end in ("low", "high")
    )
    polar = np.array([box.polar for _, box in ranges])
    return np.array([i for i, _ in ranges], np.int32), low, high, polar


def _padded(wraps: tuple[bool, ...], size: int) -> tuple[bool, ...]:
    return wraps + (False,) * (size - len(wraps))
