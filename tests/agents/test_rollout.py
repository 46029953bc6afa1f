"""Rollouts: time, frames and what stays frozen; on a toy and on the cheetah."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.agents import rollout
from rebody.agents.agent import IdleAgent, Observation
from rebody.agents.build import build_agent
from rebody.agents.clock import EvenClock, begin, decide
from rebody.agents.controller import FlatController, TrackerController
from rebody.agents.live import LiveAgent
from rebody.agents.parts import LoadedTracker
from rebody.agents.rollout import joint_action, rollout_on_robot, rollout_on_toy
from rebody.bodies import RobotBatch
from rebody.bodies.robot import Fall, RobotSpec
from rebody.errors import RebodyError
from rebody.store import tree_hash
from rebody.tasks import FamilySet
from rebody.tasks.line import GOAL
from rebody.types import Belief, Task, Transition, global_state

WINDOW = 6
SEEDS = np.array([7, 8, 9])
TARGETS = (3.0, -2.0, 8.0)


def lasting(*targets, decisions=WINDOW):
    target = np.tile(np.array(targets, np.float32), (decisions, 1))[..., None]
    return Task(np.zeros(target.shape[:2], np.int32), target)


@pytest.fixture(scope="module")
def families(inference):
    return inference.contract.families


@pytest.fixture(scope="module")
def controller(tracker, families):
    return TrackerController(tracker, families)


@pytest.fixture(scope="module")
def agent(inference):
    return build_agent("reuse", inference, horizon=5)


@pytest.fixture(scope="module")
def run(agent, controller, families, cheetah):
    """A function (targets, seeds, on_frame) -> episodes on the cheetah."""

    def run(targets=TARGETS, seeds=SEEDS, on_frame=None, spec=cheetah):
        return rollout_on_robot(agent, controller, spec, lasting(*targets), families, seeds, on_frame)

    return run


@pytest.fixture(scope="module")
def episodes(run):
    return run()


def assert_same(tree, other, **tolerance):
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, **tolerance), tree, other)


def test_shapes_and_length(episodes):
    for leaf in jax.tree.leaves((episodes.state, episodes.reward, episodes.subgoal.slot)):
        assert leaf.shape == (WINDOW, 3)
    assert episodes.subgoal.value.shape == (WINDOW, 3, 1)
    assert episodes.belief.mean.shape == episodes.belief.variance.shape == (WINDOW, 3, 2)
    assert episodes.fell.shape == (3,)
    assert np.ptp(episodes.state.x, axis=0).min() > 1e-3  # it moves


def test_rewards_are_the_tasks(episodes):
    np.testing.assert_allclose(episodes.reward, -np.abs(episodes.state.x - np.array(TARGETS)), rtol=1e-5)


def transitions(state, earned):
    """[episode, time], from a start at x = 0; the encoder sees x alone."""
    before = jax.tree.map(lambda leaf: np.concatenate([np.zeros_like(leaf[:1]), leaf[:-1]]), state)
    return jax.tree.map(lambda leaf: np.asarray(leaf).T, Transition(before, earned, state))


def test_the_belief_of_a_decision_includes_its_transition(agent, episodes):
    along = eqx.filter_jit(agent.inferrer.along)(transitions(episodes.state, episodes.reward))
    np.testing.assert_allclose(episodes.belief.mean.swapaxes(0, 1), along.mean, atol=1e-5)


def test_the_subgoal_of_a_decision_is_the_one_held_during_it(agent, cheetah, controller, families):
    heard = []
    tasks = lasting(1.0)
    episodes = rollout_on_robot(
        agent, controller, cheetah, tasks, families, SEEDS[:1], lambda _, subgoal: heard.append(subgoal.value)
    )
    assert len(heard) == WINDOW * cheetah.steps_per_decision
    np.testing.assert_array_equal(np.array(heard)[:, 0, 0], np.repeat(episodes.subgoal.value[:, 0, 0], 2))
    assert len(np.unique(heard)) == WINDOW


def test_a_goal_is_made_relative_anew_at_every_control_step(run, monkeypatch):
    """Trap 2: a constant relative goal would be chased for ever."""
    x_before, told = [0.0], []

    def spy(controller, joints, pose, subgoal, belief):
        told.append((float(pose[0, 0]), float(subgoal.value[0, 0])))
        return joint_action(controller, joints, pose, subgoal, belief)

    monkeypatch.setattr(rollout, "joint_action", spy)
    run(on_frame=lambda batch, subgoal: x_before.append(batch.qpos[0, 0]))
    x, subgoal = np.array(told).T
    np.testing.assert_allclose(x, x_before[:-1], atol=1e-6)
    np.testing.assert_array_equal(subgoal[::2], subgoal[1::2])  # two control steps a decision
    assert np.abs(np.diff(x)).min() > 0


def test_nothing_that_is_frozen_changes(inference, tracker, run):
    before = tree_hash(inference.parts), tree_hash(tracker)
    run()
    assert (tree_hash(inference.parts), tree_hash(tracker)) == before


def test_same_seeds_same_result(run, episodes):
    assert_same(run(), episodes, rtol=0, atol=0)
    other = run(seeds=SEEDS + 10)
    assert np.abs(other.state.pitch - episodes.state.pitch).min() > 0


@pytest.mark.parametrize("i", range(3))
def test_an_episode_does_not_depend_on_those_beside_it(run, episodes, i):
    alone = run(TARGETS[i : i + 1], SEEDS[i : i + 1])
    of_batch = jax.tree.map(lambda leaf: leaf[:, i : i + 1], (episodes.state, episodes.reward, episodes.subgoal))
    assert_same((alone.state, alone.reward, alone.subgoal), of_batch, atol=1e-4)
    np.testing.assert_allclose(alone.belief.mean, episodes.belief.mean[:, i : i + 1], atol=1e-5)


def test_a_fallen_robot_keeps_scoring(run, cheetah):
    spec = replace(cheetah, fall=Fall(min_height=1e9, lasts_s=0.1))
    episodes = run(spec=spec)
    assert episodes.fell.all()
    assert episodes.reward.shape == (WINDOW, 3)
    assert (episodes.reward < -1).all()


def test_a_robot_that_gets_up_again_fell(run, cheetah, monkeypatch):
    looks = iter([False, True, True] + [False] * 20)
    monkeypatch.setattr(RobotSpec, "lies", lambda spec, qpos: np.full(len(qpos), next(looks)))
    spec = replace(cheetah, fall=Fall(lasts_s=0.1))
    assert run(spec=spec).fell.all()


def test_toy_episodes_are_those_stepped_by_hand(agent, inference):
    tasks, families = lasting(*TARGETS), FamilySet((GOAL,))  # whose reward is relative
    episodes = rollout_on_toy(agent, inference.toy, tasks, families)
    step = eqx.filter_jit(lambda toy, body, action: toy.step(body, action, jax.random.key(0)))
    body = inference.toy.begin(global_state(x=jnp.zeros(3)))
    carry, command = begin(agent, inference.toy.observe(body))
    for i in range(WINDOW):
        body = step(inference.toy, body, command.action)
        state = inference.toy.observe(body)
        earned = families.reward(jax.tree.map(lambda leaf, i=i: leaf[i], tasks), state)
        held = command.subgoal
        carry, command = decide(agent, carry, Observation(state, earned))
        now = jax.tree.map(
            lambda leaf, i=i: leaf[i], (episodes.state, episodes.reward, episodes.belief, episodes.subgoal)
        )
        assert_same(now, (state, earned, carry.belief, held), atol=1e-5, rtol=1e-5)
    assert not episodes.fell.any()
    assert np.abs(episodes.state.x[-1]).min() > 0.01  # it moves


class Listener(eqx.Module):
    """Believes nothing but what it heard last: how many transitions so far, vx, reward, x before and after."""

    def initial(self, shape):
        return jnp.zeros(shape)

    def prior(self, shape):
        return Belief(jnp.zeros((*shape, 5)), jnp.ones((*shape, 5)))

    def step(self, ticks, transition):
        state, before = transition.state, transition.previous
        mean = jnp.stack([ticks + 1, state.vx, transition.reward, before.x, state.x], axis=-1)
        return ticks + 1, Belief(mean, jnp.ones_like(mean))

    def unheard(self, ticks, transition):
        return ticks


@pytest.mark.parametrize("tick_steps", [1, 2, 3, 4, 5])
def test_in_thesis_mode_the_module_hears_of_the_world_once_per_stride(controller, families, cheetah, tick_steps):
    """What is returned stays 0.1 s apart, and velocities are those of the last 0.1 s, also between decisions."""
    task, qpos = lasting(1.0), []
    task.target[WINDOW // 2 :] = -1.0
    listener = IdleAgent(inferrer=Listener(), reader=lambda belief: None, families=families, stride=1, actions=1)
    episodes = rollout_on_robot(
        listener, controller, cheetah, task, families, SEEDS[:1],
        lambda batch, _: qpos.append(batch.qpos[0].copy()), EvenClock(tick_steps),
    )  # fmt: skip
    x = np.concatenate([[0.0], np.array(qpos)[:, 0]])  # after each control step
    assert len(qpos) == 2 * WINDOW
    np.testing.assert_allclose(episodes.state.x[:, 0], x[2::2], atol=1e-6)
    np.testing.assert_allclose(episodes.state.vx[:, 0], (x[2::2] - x[:-2:2]) / 0.1, atol=1e-5)
    np.testing.assert_allclose(episodes.reward, -np.abs(episodes.state.x - task.target[..., 0]), atol=1e-6)
    for i in range(WINDOW):
        ticks = (2 * i + 2) // tick_steps
        step = ticks * tick_steps  # of the last tick by then
        before = max(step - 2, 0)  # it stood still before it began
        heard = [ticks, 0, 0, 0, 0]
        if ticks:
            target = task.target[(step - 1) // 2, 0, 0]
            heard = [ticks, (x[step] - x[before]) / 0.1, -abs(x[step] - target), x[step - tick_steps], x[step]]
        np.testing.assert_allclose(episodes.belief.mean[i, 0], heard, atol=1e-5)


def test_a_tick_per_decision_is_the_default_bit_for_bit(agent, controller, families, cheetah, episodes):
    tasks = lasting(*TARGETS)
    every_decision = EvenClock(cheetah.steps_per_decision)
    ticked = rollout_on_robot(agent, controller, cheetah, tasks, families, SEEDS, None, every_decision)
    assert_same(ticked, episodes, rtol=0, atol=0)
    seldom = rollout_on_robot(agent, controller, cheetah, tasks, families, SEEDS, None, EvenClock(5))
    assert np.abs(seldom.belief.mean - episodes.belief.mean).max() > 1e-3


def test_a_flat_policy_moves_by_the_belief_alone(inference, families, flat_policy, cheetah):
    agent, tasks = build_agent("flat", inference), lasting(*TARGETS)
    controller = FlatController(flat_policy, inference.parts.module.decoder)
    episodes = rollout_on_robot(agent, controller, cheetah, tasks, families, SEEDS)
    assert np.isnan(episodes.subgoal.value).all()
    assert np.isfinite(episodes.state.x).all()
    deaf = IdleAgent(inferrer=Deaf(), reader=lambda belief: None, families=families, stride=1, actions=1)
    deaf = rollout_on_robot(deaf, controller, cheetah, tasks, families, SEEDS)
    np.testing.assert_allclose(deaf.state.x[0], episodes.state.x[0], atol=1e-5)  # both begin with the prior
    assert np.abs(deaf.state.x[-1] - episodes.state.x[-1]).min() > 1e-4


class Deaf(eqx.Module):
    """Keeps to the prior."""

    def initial(self, shape):
        return jnp.zeros(shape)

    def prior(self, shape):
        return Belief(jnp.zeros((*shape, 2)), jnp.ones((*shape, 2)))

    def step(self, memory, transition):
        return memory, self.prior(memory.shape)

    def unheard(self, memory, transition):
        return memory


def test_bayes_finds_goals_on_the_toy(inference):
    episodes = rollout_on_toy(
        build_agent("bayes", inference), inference.toy, lasting(*TARGETS), inference.contract.families
    )
    np.testing.assert_allclose(episodes.subgoal.value[-1, :, 0], TARGETS, atol=0.011)
    np.testing.assert_array_equal(episodes.subgoal.slot, np.zeros((WINDOW, 3)))


@pytest.fixture(scope="module")
def live(inference, tracker, cheetah):
    return LiveAgent(cheetah, inference, LoadedTracker("tiny", "cheetah", tracker), horizon=5, sharpen=False)


def test_an_agent_driven_from_outside_does_the_same(live, cheetah, episodes):
    """Rewards are those of each control step; those between decisions are not heard."""
    batch = RobotBatch(cheetah, 1)
    batch.reset(np.random.default_rng(SEEDS[0]), np.array([True]))
    live.reset()
    for i in range(WINDOW):
        for step in range(cheetah.steps_per_decision):
            heard = -abs(batch.x[0] - TARGETS[0]) if step == 0 else 99.0
            batch.step(live.step(np.concatenate([batch.qpos[0], batch.qvel[0]]), float(heard))[None])
        assert batch.x[0] == pytest.approx(episodes.state.x[i, 0], abs=1e-4)
        assert live.subgoal.value == pytest.approx(episodes.subgoal.value[i, 0], abs=1e-4)
    np.testing.assert_allclose(live.belief.mean, episodes.belief.mean[-2, 0], atol=1e-5)


def test_an_observation_of_another_body_is_refused(live):
    with pytest.raises(RebodyError, match=r"the observation of 'cheetah'.* has shape \(17,\), not \(18,\)"):
        live.step(np.zeros(17), 0.0)


def test_pitch_and_height_do_not_reach_the_belief(agent):
    """Trap 4: what is constant on the toy and moves on a robot."""
    x = np.linspace(0, 1, WINDOW + 1, dtype=np.float32)[:, None]
    still = np.zeros_like(x)

    def belief(other):
        state = global_state(x=x, z=other, pitch=other, vz=other, pitch_rate=other)
        carry, _ = begin(agent, jax.tree.map(lambda leaf: leaf[0], state))
        for i in range(1, WINDOW + 1):
            now = jax.tree.map(lambda leaf, i=i: leaf[i], state)
            carry, _ = decide(agent, carry, Observation(now, -np.abs(now.x - 3)))
        return carry.belief

    assert_same(belief(still), belief(np.sin(20 * x)), rtol=0, atol=0)


def test_a_toy_begins_where_it_is_told(inference, families):
    idle = build_agent("idle", inference)
    start = global_state(x=np.array([4.0, -2.0], np.float32))
    moved = rollout_on_toy(idle, inference.toy, lasting(3.0, 3.0), families, start=start)
    np.testing.assert_allclose(moved.state.x[-1], start.x, atol=1e-5)
    np.testing.assert_allclose(rollout_on_toy(idle, inference.toy, lasting(3.0), families).state.x, 0.0, atol=1e-5)
