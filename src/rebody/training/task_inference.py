"""Robots with a frozen module each that infers their task: what policies learn from that act by its beliefs."""

from collections.abc import Mapping

import equinox as eqx
from jaxtyping import Float, PRNGKeyArray

from rebody.agents.parts import Inference
from rebody.bodies import RobotBatch
from rebody.bodies.robot import Reach
from rebody.inference import Encoder, EncoderCarry
from rebody.tasks import BaseTask, RewardForm, TaskDistribution, reward
from rebody.types import AnyArray, Belief, GlobalState, Task, Transition


class TaskInference(eqx.Module):
    """What each robot's frozen module remembers and believes, and the task that is hidden from it."""

    encoder: EncoderCarry
    belief: Belief
    state: GlobalState  # at the last decision
    task: Task


def begin_inference(encoder: Encoder, state: GlobalState, task: Task) -> TaskInference:
    """Nothing known yet."""
    shape = task.family.shape
    return TaskInference(encoder.initial(shape), encoder.prior(shape), state, task)


def begin_tasks(batch: RobotBatch, module: Inference, key: PRNGKeyArray) -> TaskInference:
    """Fresh hidden tasks for robots at rest, and nothing known about them."""
    task = tasks_within(module, batch.spec.reach).sample(key, (batch.size,))
    return begin_inference(module.parts.module.encoder, batch.spec.observe(batch.qpos, batch.qpos), task)


@eqx.filter_jit
def infer(
    encoder: Encoder, known: TaskInference, now: GlobalState, form: RewardForm
) -> tuple[TaskInference, Float[AnyArray, " robot"]]:
    """What is known once every robot's module has heard of the decision that ended now, and its reward."""
    earned = reward(known.task, now, form)
    carry, belief = encoder.step(known.encoder, Transition(known.state, earned, now))
    return TaskInference(carry, belief, now, known.task), earned


def tasks_within(module: Inference, reach: Reach) -> TaskDistribution:
    """All between a module's smallest and largest targets, but no speed or pitch that the robot does not reach.

    That is more than the module learned on: relative to a small target centimetres count, and a policy gets precise.
    """
    return within_reach(module.contract.target_ranges, reach)


def within_reach(target_ranges: Mapping[str, tuple[float, float]], reach: Reach) -> TaskDistribution:
    """Tasks of families with these ranges, as far as the robot reaches."""
    return TaskDistribution(tuple(BaseTask(name, *reach.within(name, *ends)) for name, ends in target_ranges.items()))
