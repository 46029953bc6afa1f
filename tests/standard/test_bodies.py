"""Robots of the benchmark: they move as the environments do, and hear what these pay."""

import importlib
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from rebody.bodies import load_robot, simulate
from rebody.errors import RebodyError
from rebody.tasks.task_file import TaskSpec
from rebody.types import POSE_FIELDS


@pytest.fixture(scope="module")
def benchmark():
    with pytest.MonkeyPatch.context() as patched:
        patched.syspath_prepend(Path(__file__).parents[2] / "benchmarks")
        yield importlib.import_module("standard")


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo leaves its log of the cheetah's deprecated attribute there


def test_they_move_and_are_paid_as_in_the_environment(benchmark):
    spec, tasks, seeds = load_robot("cheetah"), [0.5, 2.0], [3, 4]
    robots = benchmark.in_environments(spec, "rebody-standard/CheetahVel-v0", 2)
    robots.start(tasks, seeds)
    envs = [gymnasium.make("rebody-standard/CheetahVel-v0") for _ in tasks]
    for env, task, seed in zip(envs, tasks, seeds, strict=True):
        env.reset(seed=seed, options={"task": task})
    assert not robots.observe().vx.any()  # they stand
    x = []
    for action in np.random.default_rng(0).uniform(-1, 1, (20, 2, 6)):
        x.append(robots.qpos[:, 0].copy())
        robots.step(action)
        told = [env.step(each) for env, each in zip(envs, action, strict=True)]
        np.testing.assert_array_equal(robots.rewards, [reward for _, reward, *_ in told])
        np.testing.assert_array_equal(robots.task_rewards, [info["reward_task"] for *_, info in told])
        np.testing.assert_array_equal(robots.qpos, [env.unwrapped.data.qpos for env in envs])
    assert robots.observe().vx == pytest.approx((robots.qpos[:, 0] - x[-2]) / 0.1, abs=1e-5)


def test_a_robot_of_another_kind_is_refused(benchmark):
    with pytest.raises(RebodyError, match="'hopper' is not that of rebody-standard/CheetahVel-v0"):
        benchmark.in_environments(load_robot("hopper"), "rebody-standard/CheetahVel-v0", 1)


def test_an_ant_walks_there_as_by_itself(benchmark):
    spec = load_robot("ant")
    robots, alone = benchmark.in_environments(spec, "rebody-standard/AntGoal-v0", 1), simulate(spec, 1, threads=1)
    robots.start([(1.0, 2.0)], [0])
    alone.reset(np.random.default_rng(0))
    alone.qpos[:], alone.qvel[:] = robots.qpos, robots.qvel
    for _ in range(20):
        for each in (robots, alone):
            each.step(np.array([[0.5, 0.0, 0.1]]))
        np.testing.assert_allclose(robots.qpos, alone.qpos, atol=1e-6)
    apart = np.abs(robots.envs[0].unwrapped.data.body("torso").xpos[:2] - [1.0, 2.0]).sum()
    assert -apart - 0.1 * 8 - 0.1 < robots.rewards[0] < -apart


def test_final_errors(benchmark):
    poses = np.zeros((201, 4, 6))
    poses[:, 0, 0] = 2.0 * 0.05 * np.arange(201)  # runs at 2 m/s
    poses[:, 1, 0] = 7.0
    poses[:, 2, POSE_FIELDS.index("pitch")] = 0.5
    poses[:, 3, :2] = [3.0, 4.0]
    specs = [
        TaskSpec("velocity", (1.5,)),
        TaskSpec("goal", (7.5,)),
        TaskSpec("stand", (0.75,)),
        TaskSpec("place", (0.0, 0.0)),
    ]
    errors = benchmark.final_errors(benchmark.STANDARD["melts"], specs, poses, 0.05)
    np.testing.assert_allclose(errors, [0.5, 0.5, 0.25, 5.0])


def test_speeds_beyond_the_trackers_are_apart(benchmark):
    spec = load_robot("cheetah")
    groups = [benchmark.group_of(TaskSpec("velocity", (speed,)), spec) for speed in (2.9, -4.0)]
    assert groups == ["velocity", "velocity beyond -3 to 3 m/s"]
    assert benchmark.group_of(TaskSpec("goal", (20.0,)), spec) == "goal"


def test_robot_steps_of_the_training(benchmark):
    assert benchmark.training_steps(load_robot("cheetah")) == 2_252_800
