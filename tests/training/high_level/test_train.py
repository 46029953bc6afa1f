"""What a robot's high-level policy learns from: decisions under a frozen module and a frozen tracker."""

import equinox as eqx
import jax
import numpy as np
import pytest

from rebody.agents.parts import LoadedTracker
from rebody.bodies import RobotBatch
from rebody.control.sac import SACConfig
from rebody.control.slot_policy import subgoal_of
from rebody.store import tree_hash
from rebody.tasks import GOAL
from rebody.training.high_level import HighLevelConfig
from rebody.training.high_level.train import collect, freeze, hold, initial_state, observe, shaped
from rebody.types import Subgoal

ROBOTS, STEPS, DECISIONS, TURNS = 3, 4, 6, 3


@pytest.fixture(scope="module")
def config():
    sac = SACConfig(hidden=(8,), batch_size=8)
    return HighLevelConfig(
        robots=ROBOTS, steps=STEPS, decisions=DECISIONS, replay=ROBOTS * STEPS * TURNS, updates=2, sac=sac
    )


@pytest.fixture(scope="module")
def frozen(inference, tracker, cheetah):
    return freeze(inference, LoadedTracker("tiny", "cheetah", tracker), cheetah)


@pytest.fixture(scope="module")
def begun(cheetah, config, frozen):
    """A function: -> robots and the state of a run that begins."""

    def begun():
        batch = RobotBatch(cheetah, ROBOTS)
        batch.reset(np.random.default_rng(0))
        return batch, initial_state(config, batch, frozen, jax.random.key(0))

    return begun


@pytest.fixture(scope="module")
def turns(begun, config, frozen):
    """The replay after three turns, [decision, robot], and the minds and positions after each."""
    batch, state = begun()
    minds, metrics = [], []
    for i in range(TURNS):
        mind, measured = collect(state, batch, frozen, config, np.random.default_rng(i), jax.random.key(i))
        minds.append(mind)
        metrics.append(measured)
        state.iteration[...] += 1
        state = eqx.tree_at(lambda s: s.minds, state, mind)
    rows = jax.tree.map(lambda leaf: leaf.reshape(TURNS * STEPS, ROBOTS, *leaf.shape[1:]), state.replay)
    return rows, minds, metrics


def test_episodes_keep_their_own_clock(turns):
    """Whatever the turns: a new task and an empty mind every six decisions."""
    replay, minds, _ = turns
    assert [int(mind.encoder.ticks) for mind in minds] == [4, 2, 6]
    assert tree_hash(minds[1].task) == tree_hash(minds[2].task) != tree_hash(minds[0].task)
    goes_on = (replay.next_observation[:-1] == replay.observation[1:]).all(axis=(1, 2))
    np.testing.assert_array_equal(np.flatnonzero(~goes_on) + 1, [DECISIONS])


def test_it_is_paid_by_the_task_alone(turns, config, inference):
    """With a pull on arrival that is a function of the reward."""
    replay, minds, metrics = turns
    x = 10.0 * replay.next_observation[..., 0]  # the tiny module's policy sees x / 10 and vx / 3.5
    target = np.stack([np.asarray(minds[i].task.target) for i in (0, 2)]).repeat(DECISIONS, axis=0)
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


def test_a_subgoal_is_held_for_a_decision(begun, frozen):
    """As long as the tracker alone would need for two control steps."""
    batch, _ = begun()
    twin, _ = begun()
    subgoal = Subgoal(np.full(ROBOTS, GOAL, np.int32), np.array([3.0, -3.0, 0.0], np.float32))
    fell = hold(batch, frozen.controller, subgoal)
    for _ in range(2):
        joints, pitch = twin.tracker_state(), twin.spec.pitch(twin.qpos).astype(np.float32)
        twin.step(np.asarray(frozen.controller(joints, twin.x.astype(np.float32), pitch, subgoal, None)))
    np.testing.assert_allclose(batch.qpos, twin.qpos, atol=1e-4)
    assert not fell.any()


def test_a_policy_sees_what_the_toys_policy_sees(begun, inference, frozen):
    batch, state = begun()
    minds = state.minds
    view, interpret = inference.parts.high_level.view, inference.parts.module.decoder.interpret
    np.testing.assert_allclose(observe(minds, inference), view(minds.state, interpret(minds.belief)), atol=1e-6)
    pooled = np.array([[0.5], [-0.5], [0.1]], np.float32)
    np.testing.assert_allclose(
        subgoal_of(pooled, minds.state, frozen.slots).value, batch.x + 5 * (pooled * np.abs(pooled))[:, 0], rtol=1e-4
    )


def test_nothing_that_is_frozen_changes(begun, config, inference, tracker, frozen):
    before = tree_hash(inference.parts), tree_hash(tracker)
    batch, state = begun()
    collect(state, batch, frozen, config, np.random.default_rng(0), jax.random.key(0))
    assert (tree_hash(inference.parts), tree_hash(tracker)) == before
