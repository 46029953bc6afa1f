"""Episodes that decide at their own times, each as if it were alone."""

import equinox as eqx
import jax
import numpy as np
import pytest

from rebody.agents.build import build_agent
from rebody.agents.clock import EvenClock, PredictedClock
from rebody.agents.controller import TrackerController
from rebody.agents.rollout import rollout_on_robot
from rebody.bodies import RobotBatch
from rebody.control.command import relative, slots_among
from rebody.tasks import SHIPPED
from rebody.types import Subgoal, Task

DECISIONS = 12
SEEDS = np.array([3, 4, 5])
TARGETS = np.array([3.0, -2.0, 8.0], np.float32)
STRIDES = (1, 4, 5)


@pytest.fixture(scope="module", params=["reuse", "bayes"])
def run(request, inference, tracker, cheetah):
    """A function (clock, which episodes) -> those episodes of an agent in thesis mode."""
    agent = build_agent(request.param, inference, horizon=1)

    def run(clock, which=slice(None)):
        targets = np.tile(TARGETS[which], (DECISIONS, 1))[..., None]
        tasks, families = Task(np.zeros(targets.shape[:2], np.int32), targets), inference.contract.families
        controller = TrackerController(tracker, families)
        return rollout_on_robot(agent, controller, cheetah, tasks, families, SEEDS[which], None, clock)

    return run


class OwnStrides(PredictedClock):
    """Every episode has a fixed stride of its own."""

    def steps(self, batch, subgoal):
        return np.array(STRIDES)


def test_a_prediction_that_is_always_the_same_is_a_fixed_stride(run, always):
    predicted, even = run(PredictedClock(always(4), (0,))), run(EvenClock(4))
    jax.tree.map(np.testing.assert_array_equal, predicted, even)


def test_every_episode_ticks_at_its_own_times(run, step_predictor):
    together = run(OwnStrides(step_predictor, (0,)))
    for i, stride in enumerate(STRIDES):
        alone = run(EvenClock(stride), slice(i, i + 1))
        for mine, other in (
            (together.state.x, alone.state.x),
            (together.belief.mean, alone.belief.mean),
            (together.subgoal.value, alone.subgoal.value),
            (together.reward, alone.reward),
        ):
            np.testing.assert_allclose(mine[:, i : i + 1], other, atol=1e-4)


def test_what_is_predicted_is_held(run, step_predictor):
    """A belief changes only when a prediction has run out."""
    fickle, said = eqx.tree_at(lambda p: p.actor.net.mlp.weights[-1], step_predictor, replace_fn=lambda w: 30 * w), []

    class Spy(PredictedClock):
        def steps(self, batch, subgoal):
            said.append(super().steps(batch, subgoal))
            return said[-1]

    episodes = run(Spy(fickle, (0,)))
    assert len(np.unique(said)) > 2
    changed = (np.diff(episodes.belief.mean, axis=0) != 0).any(axis=-1)
    ticks = np.zeros((2 * DECISIONS + 21, len(SEEDS)), bool)  # after each control step
    left, told = said[0].copy(), iter(said[1:])
    for step in range(1, 2 * DECISIONS + 1):
        left -= 1
        due = left == 0
        if due.any():
            ticks[step] = due
            left = np.where(due, next(told), left)
    rows = ticks[3 : 2 * DECISIONS : 2] | ticks[4 : 2 * DECISIONS + 1 : 2]  # within each 0.1 s but the first
    assert not (changed & ~rows).any()
    assert changed.any(axis=0).all()


def test_the_prediction_is_of_what_the_robot_sees_now(step_predictor, cheetah):
    """A goal is a point in the world, so the distance to it counts."""
    batch = RobotBatch(cheetah, 3)
    batch.reset(np.random.default_rng(0))
    batch.qpos[:, 0] = (0.0, 5.0, -3.0)
    subgoal = Subgoal(np.zeros(3, np.int32), np.array([[0.1], [5.3], [-3.5]], np.float32))
    steps = PredictedClock(step_predictor, (0,)).steps(batch, subgoal)
    pose = cheetah.pose(batch.qpos)
    np.testing.assert_array_equal(pose[:, 0], [0.0, 5.0, -3.0])
    expected = step_predictor(batch.proprioception(), relative(step_predictor.families, subgoal, pose))
    np.testing.assert_array_equal(steps, expected)


def test_subgoals_are_addressed_to_the_predictors_slots(step_predictor, cheetah):
    """Whatever order the families in play have."""
    batch, in_play = RobotBatch(cheetah, 2), SHIPPED.only(("stand", "velocity", "goal"))
    value = np.array([[2.5], [0.2]], np.float32)
    steps = PredictedClock(step_predictor, slots_among(in_play, step_predictor.families)).steps(
        batch, Subgoal(np.array([1, 2], np.int32), value)
    )
    own = PredictedClock(step_predictor, (0, 1)).steps(batch, Subgoal(np.array([1, 0], np.int32), value))
    np.testing.assert_array_equal(steps, own)
