"""Robots whose walking policy was learned here, and a reward: the whole path."""

import numpy as np
import pytest
from tests.walking import robot_that_is_there

from rebody.agents.parts import load_inference, load_tracker
from rebody.bodies import simulate
from rebody.evaluation.evaluate import evaluate
from rebody.evaluation.trial import Trial
from rebody.tasks import SHIPPED
from rebody.tasks.task_file import TaskSpec


@pytest.mark.parametrize("name", ["ant", "quadruped"])
def test_a_robot_finds_out_what_is_wanted(name):
    trial = Trial(
        agent="reuse",
        inference=load_inference("plane"),
        families=SHIPPED,
        robot=robot_that_is_there(name),
        tracker=load_tracker("navigator"),
        slots_by="belief",
        sharpen=True,
        seconds=25.0,
    )
    specs = [TaskSpec("place", (2.0, -2.0)), TaskSpec("place", (-3.0, 1.0)), TaskSpec("velocity_xy", (0.0, 0.6))]
    for episode in evaluate(trial, specs, seeds=1).episodes:
        assert episode.final_error < 0.15
        assert not episode.fell
        assert episode.return_ > episode.idle_return


@pytest.mark.parametrize("name", ["ant", "go1", "quadruped"])
def test_it_goes_as_it_is_told(name):
    commands = np.array([[1.0, 0.0, 0.0], [-0.8, 0.0, 0.0], [0.0, 0.5, 0.0], [0.5, 0.0, 0.8], [0.0, 0.0, 0.0]])
    batch = simulate(robot_that_is_there(name), len(commands))
    batch.reset(np.random.default_rng(0))
    for _ in range(round(4.0 / batch.step_s)):
        batch.follow(commands)
    x, y = batch.pose()[:, :2].T
    np.testing.assert_allclose([x[0], x[1], y[2]], [4.0, -3.2, 2.0], rtol=0.25)
    assert abs(batch.observe().yaw_rate[3] - 0.8) < 0.3
    assert max(abs(x[4]), abs(y[4])) < 0.1
    assert not batch.fallen.any()
