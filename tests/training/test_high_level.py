"""What a robot's high-level policy learns from: decisions under a frozen module and a frozen tracker."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from rebody.agents.parts import LoadedTracker
from rebody.agents.rollout import follow
from rebody.bodies import RobotBatch
from rebody.control.sac import SACConfig
from rebody.control.slot_policy import subgoal_of
from rebody.store import tree_hash
from rebody.training.high_level import HighLevelConfig, HighLevelLearner, shaped
from rebody.training.motion import decision
from rebody.training.off_policy import initial_state
from rebody.types import Subgoal

ROBOTS, STEPS, DECISIONS, TURNS = 3, 4, 6, 3


@pytest.fixture(scope="module")
def config():
    sac = SACConfig(hidden=(8,), batch_size=8)
    return HighLevelConfig(
        robots=ROBOTS, steps=STEPS, decisions=DECISIONS, replay=ROBOTS * STEPS * TURNS, updates=2, sac=sac
    )


@pytest.fixture(scope="module")
def learner(inference, tracker, cheetah, config):
    return HighLevelLearner(cheetah, config, inference, LoadedTracker("tiny", "cheetah", tracker))


@pytest.fixture(scope="module")
def begun(cheetah, learner):
    """A function: -> robots and the state of a run that begins."""

    def begun():
        batch = RobotBatch(cheetah, ROBOTS)
        batch.reset(np.random.default_rng(0))
        return batch, initial_state(learner, batch, jax.random.key(0))

    return begun


@pytest.fixture(scope="module")
def turns(begun, learner):
    """The replay after three turns, [decision, robot], and what is known and the metrics after each."""
    batch, state = begun()
    known, metrics = [], []
    for i in range(TURNS):
        world, measured = learner.collect(state, batch, np.random.default_rng(i), jax.random.key(i))
        known.append(world)
        metrics.append(measured)
        state = replace(state, world=world, iteration=np.asarray(i + 1))
    rows = jax.tree.map(lambda leaf: leaf.reshape(TURNS * STEPS, ROBOTS, *leaf.shape[1:]), state.replay.rows)
    return rows, known, metrics


def test_episodes_keep_their_own_clock(turns):
    """Whatever the turns: a new task and an empty memory every six decisions."""
    replay, known, _ = turns
    assert [int(each.encoder.ticks) for each in known] == [4, 2, 6]
    assert tree_hash(known[1].task) == tree_hash(known[2].task) != tree_hash(known[0].task)
    goes_on = (replay.next_observation[:-1] == replay.observation[1:]).all(axis=(1, 2))
    np.testing.assert_array_equal(np.flatnonzero(~goes_on) + 1, [DECISIONS])


def test_it_is_paid_by_the_task_alone(turns, config, inference):
    """With a pull on arrival that is a function of the reward."""
    replay, known, metrics = turns
    x = 10.0 * replay.next_observation[..., 0]  # the tiny module's policy sees x / 10 and vx / 3.5
    target = np.stack([np.asarray(known[i].task.target)[:, 0] for i in (0, 2)]).repeat(DECISIONS, axis=0)
    earned = -np.abs(x - target)
    scaled = earned / inference.parts.module.encoder.reward_scale
    np.testing.assert_allclose(replay.reward, shaped(scaled, np.zeros(scaled.shape, bool), config), atol=1e-4)
    assert [m["task_reward"] for m in metrics] == pytest.approx(earned.reshape(TURNS, -1).mean(-1), rel=1e-4)


def test_a_fall_costs_and_arrival_pays(config):
    earned = np.array([0.0, -config.arrival_width, -1.0], np.float32)
    stood, fell = (shaped(earned, np.full(3, fallen), config) for fallen in (False, True))
    np.testing.assert_allclose(stood[:2], [config.arrival, config.arrival / 2 - config.arrival_width], rtol=1e-5)
    assert stood[2] == pytest.approx(-1.0 + config.arrival * config.arrival_width / (config.arrival_width + 1.0))
    np.testing.assert_allclose(stood - fell, config.fall, rtol=1e-5)


def test_what_is_stored_is_pooled_and_was_done(turns):
    replay, _, _ = turns
    assert replay.action.shape[-1] == 1  # one family, one slot
    assert (np.abs(replay.action) <= 1).all()
    assert len(np.unique(replay.action)) == replay.action.size


def test_a_subgoal_is_held_for_a_decision(begun, learner):
    """As long as the tracker alone would need for two control steps."""
    batch, _ = begun()
    twin, _ = begun()
    subgoal = Subgoal(np.zeros(ROBOTS, np.int32), np.array([[3.0], [-3.0], [0.0]], np.float32))
    _, fell = decision(batch, lambda _: follow(learner.controller, batch, subgoal))
    for _ in range(2):
        joints, pose = twin.proprioception(), twin.pose().astype(np.float32)
        twin.step(np.asarray(learner.controller(joints, pose, subgoal, None)))
    np.testing.assert_allclose(batch.qpos, twin.qpos, atol=1e-4)
    assert not fell.any()


def test_a_policy_sees_what_the_toys_policy_sees(begun, inference, learner):
    batch, state = begun()
    known = state.world
    view, interpret = inference.parts.high_level.view, inference.parts.module.decoder.interpret
    np.testing.assert_allclose(learner.observe(known), view(known.state, interpret(known.belief)), atol=1e-6)
    pooled = np.array([[0.5], [-0.5], [0.1]], np.float32)
    asked = subgoal_of(pooled, known.state, learner.slots).value
    np.testing.assert_allclose(asked, batch.x[:, None] + 5 * pooled * np.abs(pooled), rtol=1e-4)


def test_nothing_that_is_frozen_changes(begun, inference, tracker, learner):
    before = tree_hash(inference.parts), tree_hash(tracker)
    batch, state = begun()
    learner.collect(state, batch, np.random.default_rng(0), jax.random.key(0))
    assert (tree_hash(inference.parts), tree_hash(tracker)) == before
