"""Episodes of an agent on a toy (one compiled scan) and on robots (a loop on the host)."""

from collections import deque
from collections.abc import Callable, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from rebody.agents.agent import Agent, Observation
from rebody.agents.clock import Clock, EvenClock
from rebody.agents.controller import Controller
from rebody.bodies import RobotBatch, RobotSpec
from rebody.bodies.toys import Disturbance, Toy
from rebody.tasks import FamilySet
from rebody.types import AnyArray, Belief, GlobalState, Pose, Subgoal, Task

Starts = Sequence[int] | Int[np.ndarray, " episode"]
"""What the reset noise of each episode is drawn from."""
OnFrame = Callable[[RobotBatch, Subgoal], None]


class Episodes(eqx.Module):
    """What happened; entry i is the state after decision i, its belief includes decision i's transition."""

    state: GlobalState  # [time, episode]
    reward: Float[AnyArray, "time episode"]
    belief: Belief  # [time, episode]
    subgoal: Subgoal  # [time, episode], the one held during decision i
    fell: Bool[AnyArray, " episode"]


@eqx.filter_jit
def rollout_on_toy(
    agent: Agent, toy: Toy, tasks: Task, families: FamilySet, disturbance: Disturbance | None = None
) -> Episodes:
    """Episodes on a toy from x = 0 at rest; `tasks` are the active ones, [time, episode], of `families`."""
    still = jnp.zeros(tasks.family.shape[1])
    body = toy.initial(still, still, disturbance)
    carry, command = agent.begin(toy.observe(body))

    def advance(walk, inputs):
        body, carry, command = walk
        task, key = inputs
        body = toy.step(body, command.action, key)
        state = toy.observe(body)
        earned = families.reward(task, state)
        carry, following = agent.decide(carry, Observation(state, earned))
        return (body, carry, following), (state, earned, carry.belief, command.subgoal)

    keys = jax.random.split(jax.random.key(0), len(tasks.family))
    _, (state, earned, belief, subgoal) = jax.lax.scan(advance, (body, carry, command), (tasks, keys))
    return Episodes(state, earned, belief, subgoal, still > 0)


def rollout_on_robot(
    agent: Agent,
    controller: Controller,
    spec: RobotSpec,
    tasks: Task,
    families: FamilySet,
    starts: Starts,
    on_frame: OnFrame | None = None,
    clock: Clock | None = None,
) -> Episodes:
    """Episodes on robots from x = 0 at rest; `tasks` are the active ones, [time, episode], and the reset noise of each
    episode is drawn from its number in `starts`.

    Nothing ends early: a fallen robot lies there and keeps scoring. `on_frame` is called at every control step.
    The clock says when the agent decides (thesis mode, 6.3.3); default is every 0.1 s. What is returned stays 0.1 s
    apart.
    """
    decisions, size = tasks.family.shape
    per_decision = spec.steps_per_decision
    batch = RobotBatch(spec, size)
    for episode, seed in enumerate(starts):
        batch.reset(np.random.default_rng(seed), np.arange(size) == episode)
    trail = deque([batch.qpos.copy()], maxlen=per_decision + 1)  # over the last 0.1 s
    clock = clock or EvenClock(per_decision)
    carry, command = clock.begin(agent, spec.observe(batch.qpos, trail[0]))
    steps_left = clock.steps(batch, command.subgoal)
    fell, records = np.zeros(size, bool), []
    for step in range(1, decisions * per_decision + 1):
        held = command.subgoal
        follow(controller, batch, held, carry.belief)
        fell |= batch.fallen
        if on_frame is not None:
            on_frame(batch, held)
        trail.append(batch.qpos.copy())
        steps_left = steps_left - 1
        due, is_recorded = steps_left == 0, step % per_decision == 0
        if not (due.any() or is_recorded):
            continue
        state = spec.observe(batch.qpos, trail[0])
        i = (step - 1) // per_decision
        earned = task_reward(families, Task(tasks.family[i], tasks.target[i]), state)
        if due.any():
            carry, command = clock.decide(agent, carry, Observation(state, earned), due)
            steps_left = np.where(due, clock.steps(batch, command.subgoal), steps_left)
        if is_recorded:
            records.append((state, earned, carry.belief, held))
    state, earned, belief, subgoal = jax.tree.map(lambda *steps: np.stack(steps), *records)
    return Episodes(state, earned, belief, subgoal, fell)


def follow(controller: Controller, batch: RobotBatch, subgoal: Subgoal, belief: Belief | None = None) -> None:
    """One control step of every robot."""
    pose = batch.spec.pose(batch.qpos)
    batch.step(np.asarray(joint_action(controller, controller.see(batch), pose, subgoal, belief)))


@eqx.filter_jit
def joint_action(
    controller: Controller,
    joints: Float[AnyArray, "*episode joint"],
    pose: Pose,
    subgoal: Subgoal,
    belief: Belief | None,
) -> Float[AnyArray, "*episode action"]:
    """What the controller does with the joints of robots in these poses."""
    return controller(joints, pose, subgoal, belief)


@eqx.filter_jit
def task_reward(families: FamilySet, task: Task, state: GlobalState) -> Float[AnyArray, "*episode"]:
    """`FamilySet.reward`, compiled."""
    return families.reward(task, state)
