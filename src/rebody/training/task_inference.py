"""Robots with a frozen module each that infers their task: what policies learn from that act by its beliefs."""

import equinox as eqx
from jaxtyping import Float, PRNGKeyArray

from rebody.agents.parts import Inference
from rebody.bodies import RobotBatch
from rebody.bodies.robot import Reach
from rebody.control.places import reachable
from rebody.inference import Encoder, EncoderCarry
from rebody.tasks import FamilySet
from rebody.tasks.family_set import sample
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
    task = sample(tasks_within(module, batch.spec.reach), key, (batch.size,))
    return begin_inference(module.parts.module.encoder, batch.observe(), task)


@eqx.filter_jit
def infer(
    encoder: Encoder, known: TaskInference, now: GlobalState, families: FamilySet
) -> tuple[TaskInference, Float[AnyArray, " robot"]]:
    """What is known once every robot's module has heard of the decision that ended now, and its reward."""
    earned = families.reward(known.task, now)
    carry, belief = encoder.step(known.encoder, Transition(known.state, earned, now))
    return TaskInference(carry, belief, now, known.task), earned


def tasks_within(module: Inference, reach: Reach) -> FamilySet:
    """A module's families between their smallest and largest targets, as far as the robot reaches.

    That is more than the module learned on: relative to a small target centimetres count, and a policy gets precise.
    """
    return within_reach(module.contract.families, reach)


def within_reach(families: FamilySet, reach: Reach) -> FamilySet:
    """Those families, each with all that the robot reaches of its range as the one base task."""
    limits = dict(reach)
    return FamilySet(tuple(family.within(reachable(family, limits.get(family.name))) for family in families))
