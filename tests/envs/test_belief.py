"""A belief beside anybody's observation."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from rebody.agents.parts import load_inference
from rebody.envs import BeliefObservation
from rebody.errors import RebodyError

POINT_MASS, CHEETAH = ("rebody/PointMass-v0", 0.1), ("rebody/HalfCheetah-v0", 0.05)
NO_BOUNDS = "ignore:.*A Box observation space m(in|ax)imum value is:UserWarning"


def believing(name, control_dt, inference="goal-velocity", **functions):
    families = load_inference(inference).contract.families
    settings = {"families": families} if name.startswith("rebody/") else {}
    return BeliefObservation(gymnasium.make(name, **settings), inference, control_dt=control_dt, **functions)


@pytest.mark.filterwarnings(NO_BOUNDS)
@pytest.mark.filterwarnings("ignore:.*different from the unwrapped version:UserWarning")
@pytest.mark.parametrize("of", [POINT_MASS, CHEETAH])
def test_gymnasiums_own_checks(of):
    check_env(believing(*of), skip_render_check=True)


def test_the_belief_is_that_of_decisions_told_one_by_one():
    env, module = believing(*CHEETAH), load_inference("goal-velocity")
    observation, info = env.reset(seed=0, options={"family": "goal", "target": 5.0})
    belief, heard = module.begin(info), []
    for step in range(1, 9):
        plain, reward, _, _, info = env.step(env.action_space.sample())
        heard.append(reward)
        if step % 2 == 0:
            belief.update(info, np.mean(heard[-2:]))
        np.testing.assert_allclose(plain[18:], belief.reading.latent.features(), atol=1e-6)
    assert observation.shape == plain.shape == env.observation_space.shape == (18 + 12,)
    assert env.reading.family == belief.reading.family


def test_a_reset_forgets():
    env = believing(*CHEETAH)
    first, _ = env.reset(seed=0)
    for _ in range(3):  # to the midst of a decision
        moved, *_ = env.step(np.zeros(6))
    assert not np.array_equal(moved[18:], first[18:])
    np.testing.assert_array_equal(env.reset(seed=0)[0], first)
    early, *_ = env.step(np.zeros(6))
    np.testing.assert_array_equal(early[18:], first[18:])  # a decision takes two steps again
    late, *_ = env.step(np.zeros(6))
    assert not np.array_equal(late[18:], first[18:])


def test_somebody_elses_environment():
    """It names its states otherwise, and pays for something else."""
    env = BeliefObservation(
        gymnasium.make("CartPole-v1"),
        "position",
        control_dt=0.02,
        observe=lambda observation, info: {"x": observation[0]},
        task_reward=lambda observation, reward, info: -abs(observation[0] - 2.0),
    )
    observation, _ = env.reset(seed=0)
    assert observation.dtype == env.observation_space.dtype == np.float32
    for step in range(1, 6):
        observation, reward, *_ = env.step(step % 2)
        assert reward == 1.0
        assert np.array_equal(observation[4:], np.repeat([0.0, 1.0], 2)) == (step < 5)
    assert env.observation_space.contains(observation)


def test_a_reward_that_no_task_pays_is_doubted():
    env = BeliefObservation(
        gymnasium.make("CartPole-v1"), "position", control_dt=0.1, observe=lambda observation, info: {"x": 0.0}
    )
    env.reset(seed=0)
    env.step(0)
    (doubt,) = env.doubts
    assert "the reward was 1 in 1 decision" in doubt
    np.testing.assert_array_equal(env.reading.latent.mean, np.zeros(2))


def test_nan_is_refused_and_none_is_not_heard():
    env = BeliefObservation(
        gymnasium.make("CartPole-v1"),
        "position",
        control_dt=0.1,
        observe=lambda observation, info: {"x": 0.0},
        task_reward=lambda observation, reward, info: paid.pop(0),
    )
    paid = [None, float("nan")]
    with pytest.raises(RebodyError, match="call reset"):
        _ = env.reading
    env.reset(seed=0)
    env.step(0)
    assert env.doubts == ()
    np.testing.assert_array_equal(env.reading.latent.mean, np.zeros(2))
    with pytest.raises(RebodyError, match="the reward is nan"):
        env.step(0)


class Odd(gymnasium.Env):
    """Pays what it is told to, and says nothing when it is reset."""

    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (1,))
    action_space = gymnasium.spaces.Discrete(2)
    pays = 0.0

    def reset(self, *, seed=None, options=None):
        return np.zeros(1, np.float32), {}

    def step(self, action):
        return np.zeros(1, np.float32), self.pays, False, False, {"x": 0.0}


def test_an_environment_that_says_nothing_at_its_reset():
    env = BeliefObservation(Odd(), "position", control_dt=0.1)
    with pytest.raises(RebodyError, match="call reset"):
        env.step(0)
    for _ in range(2):  # nothing of a belief is left over either
        with pytest.raises(RebodyError, match="at the start: the state lacks 'x'"):
            env.reset()
        with pytest.raises(RebodyError, match="call reset"):
            env.step(0)


@pytest.mark.parametrize("pays", [None, "much", [1.0, 2.0], np.zeros(2)])
def test_a_reward_that_is_no_number(pays):
    env = BeliefObservation(Odd(), "position", control_dt=0.1, observe=lambda observation, info: {"x": 0.0})
    env.reset()
    env.env.pays = pays
    with pytest.raises(RebodyError, match=r"the environment's reward is .*; it must be a number"):
        env.step(0)


@pytest.mark.parametrize(
    ("said", "message"),
    [
        (3.0, "the state is of type float; give a mapping"),
        (None, "the state is of type NoneType"),
        ({"x": np.zeros(2)}, r"the state's 'x' has shape \(2,\)"),
        ({"x": "near"}, "the state's 'x' is 'near'"),
        ({"x": None}, "the state lacks 'x'"),
        ({}, "the state lacks 'x'"),
    ],
)
def test_a_state_that_is_none(said, message):
    env = BeliefObservation(Odd(), "position", control_dt=0.05, observe=lambda observation, info: states.pop(0))
    states = [{"x": 0.0, "vx": None, "pitch": "of no matter"}, said, {"x": 0.1}]
    env.reset()
    env.step(0)
    with pytest.raises(RebodyError, match=f"decision 1: {message}"):
        env.step(0)
    before = env.reading
    for _ in range(2):  # a decision takes as many steps as ever
        assert env.reading is before
        env.step(0)
    assert env.reading is not before


def test_a_task_reward_that_is_an_array():
    env = BeliefObservation(
        Odd(), "position", control_dt=0.1, observe=lambda observation, info: {"x": 0.0},
        task_reward=lambda observation, reward, info: np.zeros(1),
    )  # fmt: skip
    env.reset()
    with pytest.raises(RebodyError, match=r"the reward has shape \(1,\); give one number"):
        env.step(0)


@pytest.mark.parametrize("control_dt", [0.0, -0.1, float("nan")])
def test_a_step_takes_time(control_dt):
    with pytest.raises(RebodyError, match="control_dt is"):
        believing("rebody/PointMass-v0", control_dt)


@pytest.mark.parametrize("control_dt", [0.03, 0.2, 0.008])
def test_steps_must_divide_a_decision(control_dt):
    with pytest.raises(RebodyError, match=f"steps of {control_dt} s do not divide"):
        believing("rebody/PointMass-v0", control_dt)


def test_observations_must_be_a_vector():
    with pytest.raises(RebodyError, match="must be a vector, not Discrete"):
        believing("FrozenLake-v1", 0.1)


def test_stable_baselines3_trains_on_it():
    sb3 = pytest.importorskip("stable_baselines3")
    model = sb3.PPO("MlpPolicy", believing(*POINT_MASS), n_steps=64, batch_size=32, n_epochs=1, device="cpu")
    model.learn(256)
    assert model.num_timesteps == 256
