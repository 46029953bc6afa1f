"""Robots with a frozen module each that listens: what policies learn from that act by its beliefs."""

from collections.abc import Mapping

import equinox as eqx
import numpy as np
from jaxtyping import Float, PRNGKeyArray

from rebody.agents.parts import Inference
from rebody.bodies import RobotBatch
from rebody.bodies.robot import Reach
from rebody.inference import Encoder, EncoderCarry
from rebody.tasks import BaseTask, RewardForm, TaskDistribution, reward
from rebody.types import AnyArray, Belief, GlobalState, Task, Transition


class Minds(eqx.Module):
    """What each robot's frozen module remembers and believes, and the task that is hidden from it."""

    encoder: EncoderCarry
    belief: Belief
    state: GlobalState  # at the last decision
    task: Task


def tasks_within(module: Inference, reach: Reach) -> TaskDistribution:
    """All between a module's smallest and largest targets, but no speed or pitch that the robot does not reach.

    That is more than the module learned on: relative to a small target centimetres count, and a policy gets precise.
    """
    return within_reach(module.contract.target_ranges, reach)


def within_reach(target_ranges: Mapping[str, tuple[float, float]], reach: Reach) -> TaskDistribution:
    """Tasks of families with these ranges, as far as the robot reaches."""
    return TaskDistribution(tuple(BaseTask(name, *reach.within(name, *ends)) for name, ends in target_ranges.items()))


def new_minds(batch: RobotBatch, module: Inference, key: PRNGKeyArray) -> Minds:
    """Fresh hidden tasks, and nothing known about them."""
    encoder, shape = module.parts.module.encoder, (batch.size,)
    task = tasks_within(module, batch.spec.reach).sample(key, shape)
    return Minds(encoder.initial(shape), encoder.prior(shape), batch.spec.observe(batch.qpos, batch.qpos), task)


@eqx.filter_jit
def listen(
    encoder: Encoder, minds: Minds, now: GlobalState, form: RewardForm
) -> tuple[Minds, Float[AnyArray, " robot"]]:
    """Every robot's module takes in the decision that ended now."""
    earned = reward(minds.task, now, form)
    carry, belief = encoder.step(minds.encoder, Transition(minds.state, earned, now))
    return Minds(carry, belief, now, minds.task), earned


def put_on_feet(batch: RobotBatch, rng: np.random.Generator) -> None:
    """A robot that has fallen is put on its feet where it lies: episode and belief go on."""
    fallen, x = batch.fallen, batch.x
    batch.reset(rng, fallen)
    batch.qpos[fallen, batch.spec.root_addresses[0]] = x[fallen]
