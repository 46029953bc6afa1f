"""Commands that a tracker learns from: far and near goals, speeds, standstill, and what a toy would ask."""

from dataclasses import dataclass
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float, Int, PRNGKeyArray

from rebody import ranges
from rebody.bodies.robot import Reach
from rebody.bodies.toys import MassDamper, ToyState
from rebody.control.tracker import MARGIN, Command, slots_of
from rebody.tasks import GOAL, JUMP, STAND, family_index
from rebody.types import AnyArray, GlobalState, Subgoal, Task

SlotName = Literal["goal", "velocity", "stand", "jump"]
Share = float | Float[AnyArray, ""]
"""Of a whole, in (0, 1]."""


@dataclass(frozen=True)
class CommandDistribution:
    """How commands are drawn."""

    near_share: ranges.Share = 0.35
    """Share of goals drawn log-uniformly between 0.01 and 1 m."""
    zero_share: ranges.Share = 0.1
    """Share of commands that ask to stand still."""
    only: SlotName | None = None
    """The one slot that is asked for; None for all. One network per slot is the other way (thesis 5.6)."""

    def sample(
        self, key: PRNGKeyArray, pitch: Float[AnyArray, "*batch"], reach: Reach, speed_share: Share = 1.0
    ) -> Command:
        """A command for each robot, which is at that pitch [rad]; a little beyond what will be asked.

        `speed_share` is how much of the range of speeds is asked for.
        """
        keys, shape = jax.random.split(key, 6), pitch.shape
        unit = jax.random.uniform(keys[0], shape, minval=-1.0)
        far = MARGIN * reach.distance * unit
        sign = jnp.where(jax.random.bernoulli(keys[1], shape=shape), 1.0, -1.0)
        near = sign * 10.0 ** jax.random.uniform(keys[2], shape, minval=-2.0, maxval=0.0)
        goal = jnp.where(jax.random.bernoulli(keys[3], self.near_share, shape), near, far)
        speed = speed_share * _between(MARGIN * reach.speed[0], MARGIN * reach.speed[1], unit)
        slot = self._slots(keys[4], shape, reach)
        asked = jnp.where(slot == GOAL, goal, speed)
        if reach.pitch is not None:
            asked = jnp.where(slot == STAND, _between(MARGIN * reach.pitch[0], MARGIN * reach.pitch[1], unit), asked)
        if reach.jump is not None:
            asked = jnp.where(slot == JUMP, _between(reach.jump[0] / MARGIN, MARGIN * reach.jump[1], unit), asked)
        still = jax.random.bernoulli(keys[5], self.zero_share, shape)
        here = jnp.where(slot == STAND, pitch, 0.0)
        return Command(slot, jnp.where(still, 0.0, asked) - here)

    def _slots(self, key: PRNGKeyArray, shape: tuple[int, ...], reach: Reach) -> Int[AnyArray, "*batch"]:
        if self.only is not None:
            return jnp.full(shape, family_index(self.only))
        slots = jnp.asarray([family_index(name) for name in slots_of(reach)])
        return slots[jax.random.randint(key, shape, 0, len(slots))]


def _between(low: float, high: float, unit: Float[AnyArray, "*batch"]) -> Float[AnyArray, "*batch"]:
    """-1 becomes `low`, 1 `high`."""
    return 0.5 * (low + high) + 0.5 * (high - low) * unit


class ToyGuide(eqx.Module):
    """A toy that a scripted policy drives to a hidden task, seen `horizon` decisions ahead of the robot."""

    task: Task
    horizon: Int[AnyArray, " robot"]

    def subgoal(self, state: GlobalState, max_horizon: int) -> Subgoal:
        """Where the toy would be, from the robot's own state: the subgoals of `reuse` (thesis 5.6.2)."""
        toy = MassDamper()

        def step(toy_state: ToyState, decision):
            moved = toy.step(toy_state, _scripted_action(toy, toy_state, self.task), jax.random.key(0))
            keep = decision < self.horizon
            return jax.tree.map(lambda new, old: jnp.where(keep, new, old), moved, toy_state), None

        ahead, _ = jax.lax.scan(step, toy.from_global(state), jnp.arange(max_horizon))
        return Subgoal(self.task.family, jnp.where(self.task.family == GOAL, ahead.x, ahead.drift))


def _scripted_action(toy: MassDamper, state: ToyState, task: Task) -> Float[AnyArray, "*batch 1"]:
    """Full force towards a goal until braking is due, or the force that brings the speed at once."""
    braked = state.x + state.drift * toy.mass / toy.damping
    speed = jnp.where(task.family == GOAL, 10.0 * (task.target - braked), task.target)
    force = toy.damping * state.drift + toy.mass * (speed - state.drift) / 0.1
    return jnp.clip(force / toy.max_force, -1.0, 1.0)[..., None]
