"""A robot that walks already, and a reward: the whole path, on a cart of our own and on the makers' robots."""

import os
from pathlib import Path

import numpy as np
import pytest
from tests.walking import write_cart

from rebody.agents.live import load_agent
from rebody.agents.parts import load_inference, load_tracker
from rebody.bodies import load_robot, simulate
from rebody.errors import RebodyError
from rebody.evaluation.evaluate import evaluate
from rebody.evaluation.trial import Trial
from rebody.tasks import SHIPPED
from rebody.tasks.task_file import TaskSpec

pytest.importorskip("onnxruntime")
pytest.importorskip("onnx")
WALKING = Path(__file__).parents[2] / "examples" / "walking"
MAKERS = pytest.mark.skipif("REBODY_MAKERS" not in os.environ, reason="the makers' files are not here")


def trial_of(robot: str, seconds: float, agent: str = "reuse") -> Trial:
    return Trial(
        agent=agent,
        inference=load_inference("plane"),
        families=SHIPPED,
        robot=load_robot(robot),
        tracker=load_tracker("navigator"),
        slots_by="belief",
        sharpen=True,
        seconds=seconds,
    )


def test_a_cart_finds_out_what_is_wanted(tmp_path):
    """It cannot move sideways, took part in no training, and hears nothing but the reward."""
    specs = [
        TaskSpec("place", (3.0, -2.0)),
        TaskSpec("place", (-2.5, 1.0)),
        TaskSpec("velocity_xy", (0.0, 0.6)),
        TaskSpec("heading", (2.5,)),
    ]
    results = evaluate(trial_of(str(write_cart(tmp_path)), 25.0), specs, seeds=1)
    for episode, bound in zip(results.episodes, (0.1, 0.1, 0.15, 0.1), strict=True):
        assert episode.final_error < bound
        assert episode.inferred_family[-1] == episode.family
        assert not episode.fell
        assert episode.return_ > episode.idle_return


@MAKERS
@pytest.mark.parametrize(("name", "within"), [("go1", 0.1), ("t1", 0.1), ("berkeley", 0.1)])
def test_the_makers_robots_find_a_hidden_place(name, within):
    results = evaluate(trial_of(str(WALKING / f"{name}.toml"), 25.0), [TaskSpec("place", (2.0, 2.0))], seeds=2)
    for episode in results.episodes:
        assert episode.final_error < within
        assert not episode.fell


@MAKERS
@pytest.mark.parametrize("name", ["go1", "g1", "t1", "berkeley"])
def test_the_makers_robots_go_as_they_are_told(name):
    batch = simulate(load_robot(str(WALKING / f"{name}.toml")), 2)
    batch.reset(np.random.default_rng(0))
    for _ in range(200):
        batch.follow(np.array([[0.5, 0.0, 0.0], [0.0, 0.0, 0.8]]))
    assert 1.3 < batch.pose()[0, 0] < 2.6
    assert batch.observe().yaw_rate[1] > 0.2
    assert not batch.fallen.any()


def test_a_navigator_is_for_robots_that_walk_and_trackers_for_the_others(tmp_path):
    with pytest.raises(RebodyError, match="'navigator' was trained on 'joystick', not on 'cheetah'"):
        load_agent("cheetah", tracker="navigator")
    with pytest.raises(RebodyError, match="'tracker-cheetah' was trained on 'cheetah', not on 'cart'"):
        load_agent(str(write_cart(tmp_path)), "plane", tracker="tracker-cheetah")


def test_an_agent_drives_a_cart_step_by_step(tmp_path):
    """From outside: observation and reward in, the joystick out; it goes where the evaluated one goes."""
    robot = str(write_cart(tmp_path))
    agent, spec = load_agent(robot, "plane"), load_robot(robot)
    batch, goal, reward = simulate(spec, 1), np.array([2.0, 1.5]), None
    batch.reset(np.random.default_rng(0))
    for _ in range(round(18.0 / spec.control_dt)):
        action = agent.step(batch.observation()[0], reward)
        assert action.shape == (3,)
        batch.step(action[None])
        reward = -float(np.linalg.norm(batch.pose()[0, :2] - goal)) / 2.5
    assert agent.inferred[0] == "place"
    np.testing.assert_allclose(agent.inferred[1], goal, atol=0.05)
    np.testing.assert_allclose(batch.pose()[0, :2], goal, atol=0.1)
