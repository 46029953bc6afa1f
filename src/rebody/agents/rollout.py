"""Episodes of an agent on a toy (one compiled scan) and on robots (a loop on the host)."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from rebody.agents.agent import Agent, Carry, Observation, relative
from rebody.agents.agent import Command as AgentCommand
from rebody.bodies.robot import RobotBatch, RobotSpec
from rebody.bodies.toys import Disturbance, Toy
from rebody.control.tracker import Command, Tracker
from rebody.tasks import RewardForm, reward
from rebody.types import AnyArray, Belief, GlobalState, Subgoal, Task

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
    agent: Agent, toy: Toy, tasks: Task, form: RewardForm, disturbance: Disturbance | None = None
) -> Episodes:
    """Episodes on a toy from x = 0 at rest; `tasks` are the active ones, [time, episode]."""
    still = jnp.zeros(tasks.target.shape[1])
    body = toy.initial(still, still, disturbance)
    carry, command = agent.begin(toy.observe(body))

    def advance(walk, inputs):
        body, carry, command = walk
        task, key = inputs
        body = toy.step(body, command.action, key)
        state = toy.observe(body)
        earned = reward(task, state, form)
        carry, following = agent.decide(carry, Observation(state, earned))
        return (body, carry, following), (state, earned, carry.belief, command.subgoal)

    keys = jax.random.split(jax.random.key(0), len(tasks.target))
    _, (state, earned, belief, subgoal) = jax.lax.scan(advance, (body, carry, command), (tasks, keys))
    return Episodes(state, earned, belief, subgoal, still > 0)


def rollout_on_robot(
    agent: Agent,
    tracker: Tracker,
    spec: RobotSpec,
    tasks: Task,
    form: RewardForm,
    seeds: Int[np.ndarray, " episode"],
    on_frame: OnFrame | None = None,
) -> Episodes:
    """Episodes on robots from x = 0 at rest with reset noise; `tasks` are the active ones, [time, episode].

    Nothing ends early: a fallen robot lies there and keeps scoring. `on_frame` is called at every control step.
    """
    decisions, size = tasks.target.shape
    batch = RobotBatch(spec, size)
    for episode, seed in enumerate(seeds):
        batch.reset(np.random.default_rng(seed), np.arange(size) == episode)
    previous = batch.qpos.copy()
    carry, command = begin(agent, spec.observe(batch.qpos, previous))
    fell, records = np.zeros(size, bool), []
    for i in range(decisions):
        for _ in range(spec.steps_per_decision):
            follow(tracker, batch, command.subgoal)
            fell |= batch.fallen
            if on_frame is not None:
                on_frame(batch, command.subgoal)
        state = spec.observe(batch.qpos, previous)
        previous = batch.qpos.copy()
        task = jax.tree.map(lambda field, i=i: field[i], tasks)
        earned = task_reward(task, state, form)
        carry, following = decide(agent, carry, Observation(state, earned))
        records.append((state, earned, carry.belief, command.subgoal))
        command = following
    stacked = jax.tree.map(lambda *steps: np.stack(steps), *records)
    state, earned, belief, subgoal = stacked
    return Episodes(state, earned, belief, subgoal, fell)


def follow(tracker: Tracker, batch: RobotBatch, subgoal: Subgoal) -> None:
    """One control step towards a subgoal, made relative to where each robot is now."""
    spec = batch.spec
    joints = spec.joint_state(batch.qpos, batch.qvel)
    batch.step(np.asarray(track(tracker, joints, subgoal, batch.x.astype(np.float32))))


@eqx.filter_jit
def track(
    tracker: Tracker,
    joints: Float[AnyArray, "*episode joint"],
    subgoal: Subgoal,
    x: Float[AnyArray, "*episode"],
) -> Float[AnyArray, "*episode action"]:
    """Joint actions towards a subgoal from x [m]."""
    return tracker(joints, Command(subgoal.slot, relative(subgoal, x)))


@eqx.filter_jit
def begin(agent: Agent, state: GlobalState) -> tuple[Carry, AgentCommand]:
    """`Agent.begin`, compiled."""
    return agent.begin(state)


@eqx.filter_jit
def decide(agent: Agent, carry: Carry, observation: Observation) -> tuple[Carry, AgentCommand]:
    """`Agent.decide`, compiled."""
    return agent.decide(carry, observation)


@eqx.filter_jit
def task_reward(task: Task, state: GlobalState, form: RewardForm) -> Float[AnyArray, "*episode"]:
    """`rebody.tasks.reward`, compiled."""
    return reward(task, state, form)
