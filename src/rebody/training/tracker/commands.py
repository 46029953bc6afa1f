"""Commands that a tracker learns from: far and near places, speeds, standstill, and what a toy would ask."""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int, PRNGKeyArray

from rebody import ranges
from rebody.bodies.toys import MassDamper, ToyState
from rebody.control.command import Command, of_pose, per_slot
from rebody.control.places import UNBOUNDED
from rebody.control.tracker import MARGIN
from rebody.tasks import Family, FamilySet
from rebody.tasks.quantities import length
from rebody.types import RATE_OF, AnyArray, GlobalState, Pose, Subgoal, Task

Share = float | Float[AnyArray, ""]
"""Of a whole, in (0, 1]."""


class Draws(eqx.Module):
    """Random numbers of each robot, the same for whichever slot is asked for."""

    unit: Float[AnyArray, "*batch axis"]  # in [-1, 1)
    towards: Float[AnyArray, "*batch axis"]  # of length 1
    nearness: Float[AnyArray, "*batch"]  # exponent of a near place's distance
    near: Bool[AnyArray, "*batch"]
    still: Bool[AnyArray, "*batch"]


@dataclass(frozen=True)
class CommandDistribution:
    """How commands are drawn."""

    near_share: ranges.Share = 0.35
    """Share of places drawn log-uniformly between 0.01 and 1 m."""
    zero_share: ranges.Share = 0.1
    """Share of commands that ask to stand still."""
    only: str | None = None
    """The one slot that is asked for; None for all. One network per slot is the other way (thesis 5.6)."""

    def sample(self, key: PRNGKeyArray, pose: Pose, families: FamilySet, speed_share: Share = 1.0) -> Command:
        """A command for each robot in these poses, [*batch, 6]; a little beyond what will be asked.

        `speed_share` is how much of the range of speeds is asked for.
        """
        keys, shape = jax.random.split(key, 6), pose.shape[:-1]
        draws = Draws(
            unit=jax.random.uniform(keys[0], (*shape, families.size), minval=-1.0),
            towards=_directions(keys[1], shape, families.size),
            nearness=jax.random.uniform(keys[2], shape, minval=-2.0, maxval=0.0),
            near=jax.random.bernoulli(keys[3], self.near_share, shape),
            still=jax.random.bernoulli(keys[5], self.zero_share, shape),
        )
        slot = self._slots(keys[4], shape, families)
        asked = [families.pad(_asked(family, draws, pose, speed_share)) for family in families]
        return Command(slot, per_slot(asked, slot))

    def _slots(self, key: PRNGKeyArray, shape: tuple[int, ...], families: FamilySet) -> Int[AnyArray, "*batch"]:
        if self.only is not None:
            return jnp.full(shape, families.index(self.only))
        return jax.random.randint(key, shape, 0, len(families))


def _directions(key: PRNGKeyArray, shape: tuple[int, ...], size: int) -> Float[AnyArray, "*batch axis"]:
    """Of length 1, each as likely as any other."""
    if size == 1:
        return jnp.where(jax.random.bernoulli(key, shape=(*shape, 1)), 1.0, -1.0)
    vector = jax.random.normal(key, (*shape, size))
    return vector / length(vector)[..., None]


def _asked(family: Family, draws: Draws, pose: Pose, speed_share: Share) -> Float[AnyArray, "*batch size"]:
    """A place from where the robot is, an attitude from how it is turned, or a speed."""
    low, high = _widened(family)
    unit, is_far = draws.unit[..., : family.size], np.isin(family.quantity.components, UNBOUNDED)
    value = 0.5 * (low + high) + 0.5 * (high - low) * unit
    near = draws.towards[..., : family.size] * 10.0 ** draws.nearness[..., None]
    value = jnp.where(is_far & draws.near[..., None], near, value)
    if family.settle != "largest of 1 s":
        value = jnp.where(np.isin(family.quantity.components, list(RATE_OF)), speed_share * value, value)
    here = jnp.where(is_far, 0.0, of_pose(family, pose))
    return family.quantity.difference(jnp.where(draws.still[..., None], 0.0, value), here)


def _widened(family: Family) -> tuple[Float[np.ndarray, " size"], Float[np.ndarray, " size"]]:
    """Ends a little beyond a family's own."""
    low, high = np.array(family.range.low, np.float32), np.array(family.range.high, np.float32)
    return np.where(low > 0, low / MARGIN, low * MARGIN), np.where(high > 0, high * MARGIN, high / MARGIN)


def is_guided(family: Family) -> bool:
    """Whether a toy on the line can show the way: to places and speeds along x."""
    return family.quantity.components in (("x",), ("vx",))


class ToyGuide(eqx.Module):
    """A toy that a scripted policy drives to a hidden task, seen `horizon` decisions ahead of the robot."""

    task: Task
    horizon: Int[AnyArray, " robot"]

    def subgoal(self, families: FamilySet, state: GlobalState, max_horizon: int) -> Subgoal:
        """Where the toy would be, from the robot's own state: the subgoals of `reuse` (thesis 5.6.2)."""
        toy, is_place = MassDamper(), jnp.asarray([family.is_pose for family in families])[self.task.family]

        def step(toy_state: ToyState, decision):
            action = _scripted_action(toy, toy_state, is_place, self.task.target[..., 0])
            moved = toy.step(toy_state, action, jax.random.key(0))
            return jax.vmap(_either)(decision < self.horizon, moved, toy_state), None

        ahead, _ = jax.lax.scan(step, toy.begin(state), jnp.arange(max_horizon))
        return Subgoal(
            self.task.family, families.pad(jnp.where(is_place, ahead.position[..., 0], ahead.drift[..., 0])[..., None])
        )


def _either(which: Bool[AnyArray, ""], first: ToyState, second: ToyState) -> ToyState:
    return jax.tree.map(lambda a, b: jnp.where(which, a, b), first, second)


def _scripted_action(
    toy: MassDamper, state: ToyState, is_place: Bool[AnyArray, "*batch"], target: Float[AnyArray, "*batch"]
) -> Float[AnyArray, "*batch 1"]:
    """Full force towards a place until braking is due, or the force that brings the speed at once."""
    x, drift = state.position[..., 0], state.drift[..., 0]
    braked = x + drift * toy.mass / toy.damping
    speed = jnp.where(is_place, 10.0 * (target - braked), target)
    force = toy.damping * drift + toy.mass * (speed - drift) / 0.1
    return jnp.clip(force / toy.max_force, -1.0, 1.0)[..., None]
