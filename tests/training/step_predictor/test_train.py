"""What a step predictor learns from: robots that chase a toy, each with its own number of steps left."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.agents.parts import LoadedTracker
from rebody.bodies import RobotBatch
from rebody.control import sac
from rebody.control.command import commands_within, relative
from rebody.control.sac import SACBatch, SACConfig
from rebody.control.step_predictor import steps_of
from rebody.control.tracker import Tracker, command_inputs, tracker_observation
from rebody.errors import RebodyError
from rebody.store import tree_hash
from rebody.tasks import SHIPPED
from rebody.training.off_policy import initial_state, learn
from rebody.training.replay import Replay
from rebody.training.step_predictor import StepPredictorConfig
from rebody.training.step_predictor.chase import Fixed, advance, begin
from rebody.training.step_predictor.train import StepPredictorLearner, train_step_predictor

GOAL, VELOCITY = range(2)  # slots
ROBOTS, JOINTS = 5, 17
STEPS = (1, 2, 3, 7, 20)
"""How long each robot holds its subgoals."""


class Own(eqx.Module):
    """Each robot has its own number."""

    def __call__(self, observation, key):
        return (np.array(STEPS, np.float32)[:, None] - 0.5) / 10 - 1


@pytest.fixture(scope="module")
def config():
    return StepPredictorConfig(robots=ROBOTS, steps=20, replay=100, sac=SACConfig(hidden=(8,), batch_size=8))


@pytest.fixture
def batch(cheetah):
    batch = RobotBatch(cheetah, ROBOTS)
    batch.reset(np.random.default_rng(0))
    return batch


@pytest.fixture
def walk(batch, tracker, config):
    """A function (chooser, control steps) -> what is chased, and the transitions of each step."""

    def walk(chooser, steps):
        rng = np.random.default_rng(1)
        chase = begin(batch, tracker.families, chooser, config, jax.random.key(0))
        for step in range(steps):
            yield chase, advance(chase, batch, tracker, chooser, config, rng, jax.random.key(step))

    return walk


def test_every_robot_has_its_own_number_of_steps_left(walk):
    """Transitions are written when a count has run out, the others go on."""
    for step, (chase, seen) in enumerate(walk(Own(), 42), 1):
        ended = [steps for steps in STEPS if step % steps == 0]
        np.testing.assert_array_equal(steps_of(seen.action), ended)
        left = [steps - step % steps for steps in STEPS]
        np.testing.assert_array_equal(chase.steps_left, left)


def test_a_subgoal_is_where_the_toy_is_after_one_decision(walk, batch):
    """From rest it gets 0.07 m or 0.7 m/s far; a robot's own speed counts."""
    slots = set()
    for chase, _ in walk(Fixed(jnp.asarray(2)), 30):
        decided, state = chase.steps_left == 2, batch.observe()
        x, v = state.x, state.vx
        ahead = chase.subgoal.value[:, 0] - np.where(chase.subgoal.slot == GOAL, x + 0.08 * v, 0.8 * v)
        reach = np.where(chase.subgoal.slot == GOAL, 0.07, 0.7)
        assert (np.abs(ahead[decided]) <= reach[decided] + 1e-5).all()
        slots |= set(chase.subgoal.slot.tolist())
    assert slots == {GOAL, VELOCITY}


def test_a_transition_is_the_subgoal_its_choice_and_its_end(walk, batch, tracker):
    """Reward by hand; where one subgoal ends, the next begins."""
    steps, held, before = 3, None, None
    for step, (chase, seen) in enumerate(walk(Fixed(jnp.asarray(steps)), 12), 1):
        if step % steps:
            before = held or jax.tree.map(np.copy, chase)
            assert not len(seen.reward)
            continue
        assert before is not None
        now = batch.observe()
        error = np.abs(np.where(before.subgoal.slot == GOAL, now.x, now.vx) - before.subgoal.value[:, 0])
        paid = -error / np.maximum(np.abs(before.command.value[:, 0]), 0.05) - 0.1 * steps
        np.testing.assert_allclose(seen.reward, np.maximum(paid, -2), atol=1e-3)
        np.testing.assert_array_equal(seen.observation, before.observation)
        held = jax.tree.map(np.copy, chase)
        np.testing.assert_array_equal(seen.next_observation, held.observation)
        sees = relative(tracker.families, held.subgoal, batch.pose().astype(np.float32))
        expected = tracker_observation(batch.proprioception(), sees, tracker.families)
        np.testing.assert_allclose(held.observation, expected, atol=1e-4)
        assert not seen.terminal.any()


def test_a_fall_ends_it_all_and_is_the_worst(walk, batch):
    """Rewards are negative: an episode that ends early must not look good."""
    steps = walk(Fixed(jnp.asarray(20)), 3)
    next(steps)
    batch.qpos[1, [0, 2]] = 4.0, np.pi  # on its back, for long enough
    batch.lying_s[1] = 5.0
    chase, seen = next(steps)
    np.testing.assert_array_equal(seen.terminal, [1])
    np.testing.assert_allclose(seen.reward, [-2 / (1 - 0.98)], rtol=1e-5)
    assert abs(batch.qpos[1, 0]) < 0.2
    assert abs(batch.qpos[1, 2]) < 0.2
    np.testing.assert_array_equal(chase.steps_left, [18, 20, 18, 18, 18])
    assert batch.observe().vx[1] == 0


def test_tasks_change_only_when_a_subgoal_has_ended(walk):
    before = None
    for chase, seen in walk(Fixed(jnp.asarray(4)), 40):
        task = tree_hash(chase.task)
        assert task == before or before is None or len(seen.reward)
        before = task


def test_only_places_and_speeds_along_x_are_chased_wherever_a_tracker_has_them(batch, cheetah, config):
    families = commands_within(cheetah.reach, SHIPPED).only(("stand", "velocity", "goal"))
    slots = set()
    for seed in range(10):
        chase = begin(batch, families, Fixed(jnp.asarray(2)), config, jax.random.key(seed))
        np.testing.assert_array_equal(chase.subgoal.slot, chase.task.family)
        slots |= {families[slot].name for slot in chase.subgoal.slot}
    assert slots == {"velocity", "goal"}


def test_a_tracker_that_knows_neither_is_refused(cheetah, config, tmp_path, monkeypatch):
    families = commands_within(cheetah.reach, SHIPPED).only(("stand",))
    actor = sac.Actor(JOINTS + command_inputs(families), cheetah.model.nu, config.sac, jax.random.key(0))
    still = LoadedTracker("still", "cheetah", Tracker(actor, families))
    monkeypatch.setattr("rebody.training.step_predictor.train.load_tracker", lambda name: still)
    with pytest.raises(RebodyError, match="'still' is told neither places nor speeds along x"):
        train_step_predictor("cheetah", "still", config, tmp_path, 0)


def test_the_buffer_holds_every_subgoal_and_nothing_frozen_changes(batch, tracker, config):
    frozen = tree_hash(tracker)
    learner = StepPredictorLearner(batch.spec, config, LoadedTracker("tiny", "cheetah", tracker))
    state = initial_state(learner, batch, jax.random.key(0))
    for i in range(3):
        before = int(state.replay.written)
        learner.collect(state, batch, np.random.default_rng(i), jax.random.key(i))
        assert int(state.replay.written) - before >= ROBOTS  # no subgoal lasts longer than a turn
    rows = min(int(state.replay.written), config.replay)
    assert (state.replay.rows.reward[:rows] < 0).all()
    assert not state.replay.rows.reward[rows:].any()
    assert tree_hash(tracker) == frozen


def test_it_learns_what_pays():
    """A known answer: a subgoal of 10 steps if the first feature is 1, of 1 step if it is 0."""
    config = StepPredictorConfig(updates=600, sac=SACConfig(hidden=(32, 32), batch_size=64, learning_rate=3e-3))
    rng = np.random.default_rng(0)
    seen = rng.integers(0, 2, (1000, 1)).astype(np.float32)
    action = rng.uniform(-1, 1, (1000, 1)).astype(np.float32)
    reward = -0.1 * np.abs(np.asarray(steps_of(action)) - np.where(seen[:, 0] == 1, 10, 1)).astype(np.float32)
    ended = SACBatch(seen, action, reward, seen, np.ones(1000, np.float32))
    batches = Replay(ended, np.asarray(1000)).draw((config.updates, config.sac.batch_size), rng)
    policy = sac.initial_state(1, 1, config.sac, jax.random.key(0))
    policy, _ = learn(policy, batches, jax.random.key(1), config.sac)
    wanted = steps_of(eqx.filter_jit(policy.actor)(np.array([[0.0], [1.0]], np.float32)))
    np.testing.assert_allclose(wanted, [1, 10], atol=1)
