"""Transitions of the replay buffer, and what is learned from them under other commands."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int, PRNGKeyArray

from rebody.bodies.walking.joints import JointInterface
from rebody.control.sac import SACBatch
from rebody.ranges import Box
from rebody.training.walking.config import WalkingConfig
from rebody.training.walking.mirror import Mirror
from rebody.training.walking.reward import walking_reward
from rebody.training.walking.stride import Stride
from rebody.types import AnyArray


class ControlSteps(eqx.Module):
    """Transitions as the replay buffer holds them: the reward follows from the command, which may be another."""

    seen: Float[AnyArray, "*size number"]
    action: Float[AnyArray, "*size joint"]
    last_action: Float[AnyArray, "*size joint"]
    next_seen: Float[AnyArray, "*size number"]
    stride: Stride
    command: Float[AnyArray, "*size 3"]


class Relabelling(eqx.Module):
    """Transitions with their own command or a new one, and the reward that it would have brought, as they were or in a
    mirror.
    """

    config: WalkingConfig
    limits: Box
    scales: Float[np.ndarray, " number"]
    columns: Int[np.ndarray, " 3"]  # of an observation, where the command is
    mirror: Mirror | None
    drag_share: float | Float[AnyArray, ""] = 1.0  # of the price of dragging

    def __call__(self, steps: ControlSteps, key: PRNGKeyArray) -> SACBatch:
        """A batch to learn from."""
        fresh_key, mirror_key = jax.random.split(key)
        size = len(steps.stride.fell)
        fresh = self.config.commands.sample(fresh_key, size, self.limits)
        renewed = (jnp.arange(size) < self.config.relabelled * size)[:, None]
        command = jnp.where(renewed, fresh, steps.command)
        seen, next_seen = (jnp.asarray(each).at[:, self.columns].set(command) for each in (steps.seen, steps.next_seen))
        action = steps.action
        reward = walking_reward(command, steps.stride, action, steps.last_action, self.config.reward, self.drag_share)
        if self.mirror is not None:  # the reward is the same
            turned = jax.random.bernoulli(mirror_key, shape=(size, 1))
            seen, next_seen = (jnp.where(turned, self.mirror.seen(each), each) for each in (seen, next_seen))
            action = jnp.where(turned, self.mirror.done(action), action)
        return SACBatch(
            observation=seen * self.scales,
            action=action,
            reward=reward,
            next_observation=next_seen * self.scales,
            terminal=steps.stride.fell.astype(jnp.float32),
        )


@eqx.filter_jit
def experience(seen: ControlSteps, config: WalkingConfig, control_dt: float) -> dict[str, Float[AnyArray, ""]]:
    """What was earned per control step, and how often robots fell."""
    reward = walking_reward(seen.command, seen.stride, seen.action, seen.last_action, config.reward)
    fell = seen.stride.fell
    return {"reward": reward.mean(), "falls_per_minute": 60 * fell.sum() / (fell.size * control_dt)}


def command_columns(joints: JointInterface) -> Int[np.ndarray, " 3"]:
    """Where the command stands in what a policy hears."""
    ends = np.cumsum([joints.size(term) for term in joints.inputs])
    return np.arange(3) + ends[joints.inputs.index("command")] - 3
