"""Rewards are those of the published formulas, on MuJoCo itself; tasks are drawn as published, and stay hidden."""

import copy
import math
from pathlib import Path

import gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium.envs import mujoco as robots
from gymnasium.envs.mujoco.half_cheetah_v4 import HalfCheetahEnv
from gymnasium.utils.env_checker import check_env, data_equivalence

import rebody  # noqa: F401
from rebody.errors import RebodyError
from rebody.standard import draws

ASSETS = Path(robots.__file__).parent / "assets"
TASKS = {
    "CheetahVel": 1.7,
    "CheetahDir": -1.0,
    "AmagoCheetahVel": 0.4,
    "MeltsCheetah": ("goal_forward", 7.5),
    "MeltsCheetahChanging": ("jump", 2.0),
    "AntGoal": (1.0, -2.0),
    "AntDir": 2.5,
    "HumanoidDir": 4.0,
}
"""A task of each environment."""


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo leaves its log of the cheetah's deprecated attribute there


def make(name, **settings):
    return gymnasium.make(f"rebody-standard/{name}-v0", **settings)


class Physics:
    """A robot's model stepped by MuJoCo alone, from where an environment stands."""

    def __init__(self, xml, env):
        self.model = mujoco.MjModel.from_xml_path(str(ASSETS / xml))
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:], self.data.qvel[:] = env.unwrapped.data.qpos, env.unwrapped.data.qvel
        mujoco.mj_forward(self.model, self.data)

    def step(self, action):
        self.data.ctrl[:] = action
        for _ in range(5):
            mujoco.mj_step(self.model, self.data)
        mujoco.mj_rnePostConstraint(self.model, self.data)
        return self.data

    @property
    def torso(self):
        return self.data.body("torso").xpos[:2].copy()

    @property
    def centre_of_mass(self):
        mass = self.model.body_mass[:, None]
        return (np.sum(mass * self.data.xipos, axis=0) / np.sum(mass))[:2]


def cheetah_vel(physics, action, task):
    before = physics.data.qpos[0]
    return -abs((physics.step(action).qpos[0] - before) / 0.05 - task) - 0.05 * sum(action**2)


def cheetah_dir(physics, action, task):
    before = physics.data.qpos[0]
    return task * (physics.step(action).qpos[0] - before) / 0.05 - 0.05 * sum(action**2)


def melts(physics, action, task):
    (kind, target), data = task, physics.step(action)
    reached = {
        "velocity_forward": data.qvel[0],
        "goal_forward": data.qpos[0],
        "flip_forward": data.qvel[2],
        "stand_back": data.qpos[2],
        "jump": abs(data.qvel[1]),
    }[kind]
    return -abs(reached - target) / abs(target) - 0.05 * sum(action**2)


def contact(data):
    return 5e-4 * np.sum(np.clip(data.cfrc_ext, -1, 1) ** 2)


def ant_goal(physics, action, task):
    data = physics.step(action)
    return -np.abs(physics.torso - task).sum() - 0.1 * sum(action**2) - contact(data)


def ant_dir(physics, action, task):
    before, data = physics.torso, physics.step(action)
    velocity = (physics.torso - before) / 0.05
    return velocity @ [math.cos(task), math.sin(task)] - 0.5 * sum(action**2) - contact(data) + 1.0


def humanoid_dir(physics, action, task):
    before, data = physics.centre_of_mass, physics.step(action)
    moved = (physics.centre_of_mass - before) @ [math.cos(task), math.sin(task)]
    cost = 0.1 * sum(action**2) + min(5e-7 * np.sum(data.cfrc_ext**2), 10)
    return 0.25 * moved / 0.003 - cost + 5.0


FORMULAS = [
    ("CheetahVel", "half_cheetah.xml", cheetah_vel, 0.0),
    ("CheetahVel", "half_cheetah.xml", cheetah_vel, 2.6),
    ("CheetahDir", "half_cheetah.xml", cheetah_dir, -1.0),
    ("AmagoCheetahVel", "half_cheetah.xml", cheetah_vel, 1.2),
    ("MeltsCheetah", "half_cheetah.xml", melts, ("velocity_forward", 4.0)),
    ("MeltsCheetah", "half_cheetah.xml", melts, ("goal_forward", 7.5)),
    ("MeltsCheetah", "half_cheetah.xml", melts, ("flip_forward", 7.0)),
    ("MeltsCheetah", "half_cheetah.xml", melts, ("stand_back", -1.0)),
    ("MeltsCheetah", "half_cheetah.xml", melts, ("jump", 2.0)),
    ("AntGoal", "ant.xml", ant_goal, (1.0, -2.0)),
    ("AntDir", "ant.xml", ant_dir, 2.5),
    ("HumanoidDir", "humanoid.xml", humanoid_dir, 4.0),
]


@pytest.mark.parametrize(("name", "xml", "formula", "task"), FORMULAS)
def test_rewards_are_those_of_the_formula(name, xml, formula, task):
    env = make(name)
    env.reset(seed=5, options={"task": task})
    physics, rng = Physics(xml, env), np.random.default_rng(1)
    for _ in range(25):  # until it has fallen on its feet
        action = rng.uniform(env.action_space.low, env.action_space.high)
        expected = formula(physics, action, task)
        _, reward, terminated, _, info = env.step(action)
        assert reward == pytest.approx(expected, rel=1e-12, abs=1e-12)
        assert reward == pytest.approx(sum(part for key, part in info.items() if key.startswith("reward_")), rel=1e-12)
        if terminated:
            break


def test_contact_costs_something():
    env = make("AntGoal")
    env.reset(seed=0)
    parts = [env.step(np.zeros(8))[-1]["reward_contact"] for _ in range(30)]
    assert min(parts) < 0


GOLDEN = [  # actions of 0.5: half a metre a second off, and so on
    ("CheetahVel", 2.0, 1.3, -0.7 - 0.05 * 6 * 0.25),
    ("CheetahDir", -1.0, 1.3, -1.3 - 0.05 * 6 * 0.25),
    ("AmagoCheetahVel", 2.0, 1.3, -0.7 - 0.05 * 6 * 0.25),
    ("MeltsCheetah", ("velocity_backward", -4.0), 1.3, -3.0 / 4.0 - 0.075),  # the moment's, not 1.3
    ("MeltsCheetah", ("goal_backward", -8.0), 1.3, -8.5 / 8.0 - 0.075),
    ("MeltsCheetah", ("flip_forward", 5.0), 1.3, -2.0 / 5.0 - 0.075),
    ("MeltsCheetah", ("stand_front", 0.8), 1.3, -0.5 / 0.8 - 0.075),
    ("MeltsCheetah", ("jump", 2.5), 1.3, -0.5 / 2.5 - 0.075),
]


@pytest.mark.parametrize(("name", "task", "x_velocity", "reward"), GOLDEN)
def test_golden_rewards_of_a_cheetah(name, task, x_velocity, reward):
    env = make(name).unwrapped
    env.reset(seed=0, options={"task": task})
    qpos, qvel = np.zeros(9), np.zeros(9)
    qpos[[0, 2]], qvel[:3] = [0.5, 0.3], [-1.0, -2.0, 3.0]
    env.set_state(qpos, qvel)
    assert env._get_rew(x_velocity, np.full(6, 0.5))[0] == pytest.approx(reward, abs=1e-12)


def test_golden_rewards_of_the_ant():
    env = make("AntGoal").unwrapped
    env.reset(seed=0, options={"task": [1.0, -2.0]})
    qpos = env.init_qpos.copy()
    qpos[:3] = [0.25, 0.5, 3.0]  # in the air, so nothing touches
    env.set_state(qpos, env.init_qvel)
    mujoco.mj_rnePostConstraint(env.model, env.data)
    assert env._get_rew(0.0, np.full(8, 0.5))[0] == pytest.approx(-0.75 - 2.5 - 0.1 * 8 * 0.25, abs=1e-12)


def test_amagos_physics_are_v4s():
    ours, theirs = make("AmagoCheetahVel"), HalfCheetahEnv()
    observation, _ = ours.reset(seed=2)
    np.testing.assert_array_equal(observation, theirs.reset(seed=2)[0])
    for action in np.random.default_rng(0).uniform(-1, 1, (40, 6)):
        np.testing.assert_array_equal(ours.step(action)[0], theirs.step(action)[0])


@pytest.mark.parametrize(("name", "steps"), [(name, 1000 if "Amago" in name else 200) for name in TASKS])
def test_horizons(name, steps):
    env = make(name)
    env.reset(seed=0)
    env.unwrapped.do_simulation = lambda *_: None  # the time alone
    truncated = [env.step(np.zeros(env.action_space.shape))[3] for _ in range(steps)]
    assert truncated.index(True) == steps - 1


@pytest.mark.parametrize(("name", "low", "high"), [("AntDir", 0.2, 1.0), ("HumanoidDir", 1.0, 2.0)])
def test_ends_where_the_original_does(name, low, high):
    env = make(name)
    env.unwrapped.do_simulation = lambda *_: None  # it stays where it is put
    for height, ends in ((low - 1e-3, True), (low + 1e-3, False), (high - 1e-3, False), (high + 1e-3, True)):
        env.reset(seed=0)
        qpos = env.unwrapped.init_qpos.copy()
        qpos[2] = height
        env.unwrapped.set_state(qpos, env.unwrapped.init_qvel)
        assert env.step(np.zeros(env.action_space.shape))[2] == ends


@pytest.mark.parametrize("name", [name for name in TASKS if name not in ("AntDir", "HumanoidDir")])
def test_others_never_end(name):
    env = make(name)
    env.reset(seed=0)
    qpos = env.unwrapped.init_qpos.copy()
    qpos[2] += 1.5
    env.unwrapped.set_state(qpos, env.unwrapped.init_qvel)
    assert not env.step(np.zeros(env.action_space.shape))[2]


DRAWN = [
    ("CheetahVel", 100, 30, (0.7860740250467451, 0.47605191646339684), 2.050959316523306),
    ("AmagoCheetahVel", 100, 30, (0.7860740250467451, 0.47605191646339684), 2.050959316523306),
    ("HumanoidDir", 100, 30, (1.646349588176409, 0.9970408023258329), 4.295519147734107),
    ("CheetahDir", 2, 2, (-1.0, 1.0), -1.0),
    ("AntDir", 2, 2, (0.0, math.pi), 0.0),
    (
        "AntGoal",
        150,
        30,
        ((-0.16195957254423726, 2.139567256616772), (1.2382478130829737, 1.9159624001607145)),
        (-2.225341148322921, -0.6972068945968254),
    ),
    (
        "MeltsCheetah",
        80,
        40,
        (("velocity_forward", 2.4285714285714284), ("velocity_forward", 1.8571428571428572)),
        ("velocity_forward", 5.0),
    ),
]


@pytest.mark.parametrize(("name", "train", "test", "first", "tested"), DRAWN)
def test_tasks_are_drawn_as_published(name, train, test, first, tested):
    tasks = make(name).unwrapped.tasks
    assert (len(tasks.train), len(tasks.test)) == (train, test)
    assert tasks.train[:2] == first
    assert tasks.test[0] == tested


def test_pearls_draw_by_numpys_global_seed():
    before = np.random.get_state()
    np.random.seed(1337)
    expected = np.random.uniform(0.0, 3.0, size=(130,))
    np.random.set_state(before)
    tasks = make("CheetahVel").unwrapped.tasks
    np.testing.assert_array_equal([*tasks.train, *tasks.test], expected)


def test_melts_has_each_base_task_evenly():
    tasks = draws.base_tasks()
    for name, ends in draws.BASE_TASKS.items():
        of_name = [[target for kind, target in split if kind == name] for split in (tasks.train, tasks.test)]
        assert [len(each) for each in of_name] == [10, 5]
        np.testing.assert_allclose(sorted(np.abs(np.concatenate(of_name))), np.linspace(*np.abs(ends), 15))


@pytest.mark.parametrize("name", TASKS)
@pytest.mark.parametrize("split", ["train", "test", "any"])
def test_a_reset_draws_from_the_split(name, split):
    env = make(name, split=split)
    drawn = [env.reset(seed=seed)[1]["task"] for seed in range(12)]
    assert len(set(drawn)) > 1
    assert drawn == [env.reset(seed=seed)[1]["task"] for seed in range(12)]
    tasks = env.unwrapped.tasks
    if split != "any":
        assert set(drawn) <= set(getattr(tasks, split))
    assert all(tasks.admit(task) == task for task in drawn)


def test_any_task_is_within_the_published_ranges():
    rng = np.random.default_rng(0)
    speeds = [draws.speeds().draw(rng) for _ in range(200)]
    radii = [math.hypot(*draws.places().draw(rng)) for _ in range(200)]
    assert 0 <= min(speeds) < 0.2
    assert 2.8 < max(speeds) <= 3
    assert 2.8 < max(radii) <= 3
    assert np.median(radii) == pytest.approx(3 * 0.5**0.5, abs=0.2)  # even over the disc
    for name, target in (draws.base_tasks().draw(rng) for _ in range(200)):
        low, high = sorted(draws.BASE_TASKS[name])
        assert low <= target <= high


@pytest.mark.parametrize(("name", "task"), TASKS.items())
def test_the_task_is_in_the_info_only(name, task):
    env = make(name)
    observation, info = env.reset(seed=0, options={"task": task})
    assert info["task"] == task
    assert env.step(np.zeros(env.action_space.shape))[-1]["task"] == task
    another = env.unwrapped.tasks.test[1]
    told, info = env.reset(seed=0, options={"task": another})
    assert info["task"] == another
    np.testing.assert_array_equal(observation, told)


SHAPES = {"CheetahVel": 20, "AmagoCheetahVel": 17, "MeltsCheetah": 20, "AntGoal": 113, "AntDir": 27, "HumanoidDir": 376}


@pytest.mark.parametrize(("name", "size"), SHAPES.items())
def test_observations_are_as_long_as_the_originals(name, size):
    env = make(name)
    assert env.observation_space.shape == env.reset(seed=0)[0].shape == (size,)


def test_the_task_changes_before_every_80th_step():
    env = make("MeltsCheetahChanging", split="test")
    for seed in (0, 1):
        _, info = env.reset(seed=seed)
        told = [info["task"], *(env.step(np.zeros(6))[-1]["task"] for _ in range(200))]
        changes = [step for step in range(1, 201) if told[step] != told[step - 1]]
        assert changes == [80, 160]
        assert set(told) <= set(env.unwrapped.tasks.test)


def test_the_task_stays_otherwise():
    env = make("MeltsCheetah")
    _, info = env.reset(seed=0)
    assert {info["task"], *(env.step(np.zeros(6))[-1]["task"] for _ in range(170))} == {info["task"]}


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("CheetahVel", {"speed": 1.0}, r'give \{"task": ...\}'),
        ("CheetahVel", 1.0, r'give \{"task": ...\}'),
        ("CheetahVel", {"task": "fast"}, "the task is 'fast'; give a number"),
        ("CheetahVel", {"task": float("nan")}, "the task is nan; give a finite number"),
        ("CheetahDir", {"task": 0.5}, "give -1"),
        ("AntGoal", {"task": 1.0}, r"the task has shape \(\), not \(2,\)"),
        ("MeltsCheetah", {"task": 1.0}, "give a base task and its target"),
        ("MeltsCheetah", {"task": ("goal_up", 1.0)}, "Base tasks are: velocity_forward"),
        ("MeltsCheetah", {"task": ("jump", 0.0)}, "target is 0"),
    ],
)
def test_what_is_no_task_is_refused(name, options, message):
    with pytest.raises(RebodyError, match=message):
        make(name).unwrapped.reset(options=options)


def test_a_split_that_there_is_not():
    with pytest.raises(RebodyError, match=r"unknown split 'tests'. Did you mean 'test'\?"):
        make("CheetahVel", split="tests")


@pytest.mark.filterwarnings("ignore:.*A Box observation space m(in|ax)imum value is:UserWarning")
@pytest.mark.parametrize("name", TASKS)
def test_gymnasiums_own_checks(name):
    # the one warning: positions have no bounds
    check_env(make(name).unwrapped, skip_render_check=True)


@pytest.mark.parametrize("name", TASKS)
def test_copies_and_seeds(name):
    env = make(name, split="test")
    other = copy.deepcopy(env)
    assert data_equivalence(env.reset(seed=4), other.reset(seed=4), exact=True)
    env.action_space.seed(0)
    for _ in range(90):
        action = env.action_space.sample()
        assert data_equivalence(env.step(action), other.step(action), exact=True)


def test_registered_with_a_prefix():
    make_by = "rebody:rebody-standard/CheetahVel-v0"
    assert gymnasium.make(make_by, split="test").unwrapped.split == "test"
