"""The environments keep Gymnasium's rules, hide their task, and are the same alone and together."""

import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env, data_equivalence

from rebody.envs.world import DEFAULT_FAMILIES
from rebody.errors import RebodyError
from rebody.ranges import Box, interval
from rebody.tasks import Family, FamilySet, Quantity
from rebody.tasks.line import GOAL, VELOCITY

IDS = ["rebody/PointMass-v0", "rebody/HalfCheetah-v0"]


@pytest.fixture(params=IDS)
def env(request):
    env = gymnasium.make(request.param)
    yield env
    env.close()


@pytest.mark.filterwarnings("ignore:.*A Box observation space m(in|ax)imum value is:UserWarning")
def test_gymnasiums_own_checks(env):
    # the one warning: positions have no bounds
    check_env(env.unwrapped)


@pytest.mark.parametrize("name", IDS)
def test_registered_by_an_import_that_stays_light(name):
    code = (
        "import sys, rebody, gymnasium; assert not {'jax', 'mujoco'} & sys.modules.keys();"
        f"print(gymnasium.spec('{name}').max_episode_steps)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert int(done.stdout) in (200, 400)


def test_module_prefix():
    gymnasium.make("rebody:rebody/PointMass-v0").close()


def test_spaces():
    point, cheetah = (gymnasium.make(name) for name in IDS)
    assert (point.observation_space.shape, point.action_space.shape) == ((2,), (1,))
    assert (cheetah.observation_space.shape, cheetah.action_space.shape) == ((18,), (6,))
    assert point.observation_space.dtype == cheetah.observation_space.dtype == np.float64


def test_lasts_twenty_seconds_and_never_terminates(env):
    env.reset(seed=0)
    steps = 20 * env.metadata["render_fps"]
    for i in range(steps):
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        assert not terminated
        assert truncated == (i == steps - 1)


def test_the_task_is_in_the_info_only(env):
    first, info = env.reset(seed=0, options={"family": "goal", "target": -3.3})
    second, other = env.reset(seed=0, options={"family": "velocity", "target": 2.0})
    np.testing.assert_array_equal(first, second)
    assert (info["family"], *info["target"]) == ("goal", -3.3)
    assert (other["family"], *other["target"]) == ("velocity", 2.0)


@pytest.mark.parametrize(("form", "scale"), [("plain", 1.0), ("relative", 4.0)])
@pytest.mark.parametrize("name", IDS)
def test_reward_is_the_error_at_the_global_state(name, form, scale):
    env = gymnasium.make(name, families=DEFAULT_FAMILIES.paid_by(form))
    for family, field in (("goal", "x"), ("velocity", "vx")):
        env.reset(seed=0, options={"family": family, "target": -4.0})
        for _ in range(3):
            _, reward, _, _, info = env.step(env.action_space.sample())
            assert reward == pytest.approx(-abs(info[field] + 4.0) / scale, rel=1e-5)


def test_velocity_is_the_mean_over_the_last_tenth_of_a_second(env):
    steps = env.metadata["render_fps"] // 10
    observation, info = env.reset(seed=0)
    assert info["vx"] == 0.0
    x = [observation[0]] * steps  # as if it had stood still before
    for _ in range(10):
        observation, _, _, _, info = env.step(env.action_space.sample())
        x.append(observation[0])
        assert info["x"] == pytest.approx(x[-1], abs=1e-6)
        assert info["vx"] == pytest.approx((x[-1] - x[-1 - steps]) / 0.1, abs=1e-5)


def test_tasks_are_drawn_from_the_targets_of_families():
    families = FamilySet((GOAL.within(interval(5.0, 6.0)), VELOCITY.within(interval(-2.0, -1.0))))
    env = gymnasium.make(IDS[0], families=families)
    infos = [env.reset(seed=seed)[1] for seed in range(40)]
    goals = [info["target"][0] for info in infos if info["family"] == "goal"]
    velocities = [info["target"][0] for info in infos if info["family"] == "velocity"]
    assert min(len(goals), len(velocities)) > 8
    assert 5.0 <= min(goals) < max(goals) <= 6.0
    assert -2.0 <= min(velocities) < max(velocities) <= -1.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"family": "goal"}, "'family' and 'target' together"),
        ({"target": 1.0}, "'family' and 'target' together"),
        ({"family": "goal", "target": 1.0, "speed": 1}, "'speed'; give 'family' and 'target'"),
        ({"family": "gaol", "target": 1.0}, r"Did you mean 'goal'\?"),
        ({"family": 3, "target": 1.0}, "unknown family '3'"),
        ({"family": "goal", "target": "far"}, "the target is 'far'; give a number"),
        ({"family": "goal", "target": float("nan")}, "the target is nan; give a finite number"),
        ({"family": "goal", "target": None}, "the target is None; give a number"),
        ({"family": "goal", "target": [1.0, 2.0]}, r"a target of 'goal' has 1 numbers \(x\), not 2"),
    ],
)
def test_malformed_options(options, message):
    with pytest.raises(RebodyError, match=message):
        gymnasium.make(IDS[0]).reset(options=options)


@pytest.mark.parametrize("families", [[], GOAL, "goal"])
def test_what_is_no_set_of_families_is_refused(families):
    with pytest.raises(RebodyError, match=r"give a rebody\.tasks\.FamilySet"):
        gymnasium.make(IDS[0], families=families)


def test_a_target_of_several_numbers():
    """Beside a family of one number."""
    place = Family("place", Quantity("p", ("x", "z"), "m", "place"), (Box((1.0, 0.0), (4.0, 0.5)),), 1.0, 0.25, "plain")
    env = gymnasium.make(IDS[1], families=FamilySet((place, *DEFAULT_FAMILIES)))
    _, info = env.reset(seed=0, options={"family": "goal", "target": -3.0})
    np.testing.assert_array_equal(info["target"], [-3.0])
    env.reset(seed=0, options={"family": "place", "target": [2.0, 0.3]})
    for _ in range(3):
        _, reward, _, _, info = env.step(env.action_space.sample())
        np.testing.assert_array_equal(info["target"], [2.0, 0.3])
        assert reward == pytest.approx(-np.hypot(info["x"] - 2.0, info["z"] - 0.3), rel=1e-5)


def vector(name, mode, **settings):
    return gymnasium.make_vec(name, 3, vectorization_mode=mode, max_episode_steps=5, **settings)


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize("options", [None, {"family": "velocity", "target": -2.0}])
def test_together_as_alone(name, options):
    """Over two automatic resets, against Gymnasium's own wrapper of single environments."""
    ours, theirs = vector(name, "vector_entry_point"), vector(name, "sync")
    assert ours.metadata == theirs.metadata
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    assert data_equivalence(ours.reset(seed=7, options=options), theirs.reset(seed=7, options=options))
    ours.action_space.seed(0)
    for _ in range(14):
        actions = ours.action_space.sample()
        assert data_equivalence(ours.step(actions), theirs.step(actions))
    assert data_equivalence(ours.reset(), theirs.reset())


@pytest.mark.parametrize("name", IDS)
def test_what_a_vector_environment_returned_stays_as_it_was(name):
    envs = vector(name, "vector_entry_point")
    observation, info = envs.reset(seed=0)
    kept = observation.copy(), info["target"].copy(), info["x"].copy()
    for _ in range(7):
        envs.step(np.ones(envs.action_space.shape, np.float32))
    assert data_equivalence((observation, info["target"], info["x"]), kept, exact=True)


@pytest.mark.parametrize("name", IDS)
def test_a_vector_environment_draws_each_body(name):
    envs = vector(name, "vector_entry_point", render_mode="rgb_array")
    envs.reset(seed=0)
    pictures = envs.render()
    envs.close()
    assert len(pictures) == 3
    assert all(picture.shape == (480, 640, 3) and picture.dtype == np.uint8 for picture in pictures)


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize(
    "spoil", [lambda a: a * np.nan, lambda a: a.astype(float) + 1e39, lambda a: a[:-1], lambda a: None, str]
)
def test_an_action_that_cannot_be_is_refused_and_nothing_moves(name, spoil):
    env = gymnasium.make(name, disable_env_checker=True)
    env.reset(seed=0)
    *_, info = env.step(env.action_space.sample())
    with pytest.raises(RebodyError, match="the action"):
        env.unwrapped.step(spoil(env.action_space.sample()))
    assert env.unwrapped._info() == info


@pytest.mark.parametrize("name", IDS)
def test_many_bodies_need_an_action_each(name):
    envs = gymnasium.make_vec(name, num_envs=3, vectorization_mode="vector_entry_point")
    envs.reset(seed=0)
    (actions,) = envs.single_action_space.shape
    for shape in ((actions,), (1, actions), (3, actions + 1), (3,)):
        if shape != (3, actions):
            with pytest.raises(RebodyError, match=rf"the array of actions has shape .*, not \(3, {actions}\)"):
                envs.step(np.zeros(shape))
