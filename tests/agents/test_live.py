"""An agent on a robot: bad input never reaches the joints, and never the belief."""

import gymnasium
import jax
import numpy as np
import pytest

import rebody
from rebody.agents.live import HOLD_S, LiveAgent
from rebody.agents.parts import LoadedTracker
from rebody.errors import RebodyError
from rebody.tasks.line import LINE

NUMBERS = 18
"""In an observation of the cheetah."""
STEPS = round(HOLD_S / 0.05)


@pytest.fixture
def agent_that(cheetah, inference, tracker):
    def make(**options):
        return LiveAgent(cheetah, inference, LoadedTracker("tiny", "cheetah", tracker), horizon=5, **options)

    return make


def good(step: int):
    observation = np.zeros(NUMBERS)
    observation[0] = 0.05 * step
    return observation


def spoilt(step: int, entry: int, value: float):
    observation = good(step)
    observation[entry] = value
    return observation


BAD = [
    (spoilt(0, 4, np.nan), -1.0, r"\(qpos with x, then qvel\)\[4\] is nan; give a finite number"),
    (spoilt(0, 0, np.inf), -1.0, r"\[0\] is inf"),
    (spoilt(0, 17, 3.4e38), -1.0, r"\[17\] is 3.4e\+38; give a number of at most 1e\+06"),
    (good(0)[:-1], -1.0, r"has shape \(17,\), not \(18,\)"),
    (None, -1.0, "is None; give"),
    (["a"] * NUMBERS, -1.0, r"is \['a', 'a'"),
    (good(0), np.nan, "the reward is nan"),
    (good(0), "high", "the reward is 'high'; give a number"),
    (good(0), -1e39, r"the reward is -1e\+39"),
]


@pytest.mark.parametrize(("observation", "reward", "says"), BAD)
def test_bad_input_is_an_error_that_names_value_field_and_decision(observation, reward, says, agent_that):
    agent = agent_that()
    for step in range(4):
        agent.step(good(step), -1.0)
    before = jax.tree.leaves(agent.belief)
    with pytest.raises(RebodyError, match=f"^decision 2: .*{says}"):
        agent.step(observation, reward)
    np.testing.assert_array_equal(before, jax.tree.leaves(agent.belief))


@pytest.mark.parametrize(("observation", "reward", "says"), BAD)
def test_a_sensor_that_drops_out_is_held_over_and_then_the_robot_stands_still(observation, reward, says, agent_that):
    agent = agent_that(on_bad_input="hold")
    for step in range(7):
        agent.step(good(step), -1.0)
    subgoal, believed = agent.subgoal, agent.belief.mean
    for _ in range(STEPS):
        assert np.isfinite(agent.step(observation, reward)).all()
        assert agent.status.mode == "holding"
        np.testing.assert_array_equal(jax.tree.leaves(agent.subgoal)[0], jax.tree.leaves(subgoal)[0])
    for _ in range(3):
        assert np.isfinite(agent.step(observation, reward)).all()
    assert agent.status.mode == "standing still"
    slot, value = int(agent.subgoal.slot), agent.subgoal.value.tolist()
    assert (slot, value) == (1, [0.0])  # a speed, which the tracker knows beside the module's goals
    np.testing.assert_array_equal(agent.belief.mean, believed)
    agent.step(good(8), -1.0)
    assert agent.status == agent.status.__class__("running", None, (), ())


def test_a_gap_ends_in_the_belief_of_a_run_in_which_nothing_was_heard_meanwhile(agent_that):
    """States beside a gap have no velocity, so three decisions pass before a transition is whole again."""
    with_gap, in_silence = agent_that(on_bad_input="hold"), agent_that()
    for step in range(30):
        is_bad = step == 10
        with_gap.step(spoilt(step, 0, np.nan) if is_bad else good(step), -1.0)
        in_silence.step(good(step), None if 10 <= step < 16 else -1.0)
    np.testing.assert_allclose(with_gap.belief.mean, in_silence.belief.mean, rtol=1e-5)


def test_only_the_bad_numbers_are_held(agent_that):
    agent, other = agent_that(on_bad_input="hold"), agent_that()
    for step in range(3):
        agent.step(good(step), -1.0), other.step(good(step), -1.0)
    np.testing.assert_array_equal(agent.step(spoilt(3, 5, np.nan), None), other.step(good(3), None))


def test_nothing_heard_is_valid(agent_that):
    agent = agent_that()
    agent.step(good(0), None)
    for step in range(1, 9):
        agent.step(good(step), None)
    np.testing.assert_array_equal(agent.belief.mean, np.zeros(2))
    assert agent.status.bad_input is None


def test_an_impossible_reward_is_in_the_status_and_not_in_the_belief(agent_that):
    agent = agent_that()
    for step in range(7):
        agent.step(good(step), 7.0)
    np.testing.assert_array_equal(agent.belief.mean, np.zeros(2))
    assert "the reward was 7 in 3 decisions" in agent.status.doubts[0]


def test_what_cannot_be_asked_for_is_said(agent_that):
    with pytest.raises(RebodyError, match="choose one of error, hold"):
        agent_that(on_bad_input="ignore")
    with pytest.raises(RebodyError, match="call step first"):
        _ = agent_that().inferred
    with pytest.raises(RebodyError, match=r"\[4\] is nan"):  # nothing to hold on to
        agent_that(on_bad_input="hold").step(spoilt(0, 4, np.nan), 0.0)


def test_what_is_inferred_is_a_family_and_a_vector(agent_that):
    agent = agent_that(sharpen=False)
    agent.step(good(0), None)
    assert agent.inferred == ("goal", (pytest.approx(0.5),))  # what the tiny probe says of the prior


def test_a_real_run_gives_no_doubts():
    env = gymnasium.make("rebody/HalfCheetah-v0", families=LINE)
    agent = rebody.load_agent()
    observation, _ = env.reset(seed=0, options={"family": "velocity", "target": 2.0})
    reward = 0.0
    for _ in range(120):
        observation, reward, *_ = env.step(agent.step(observation, reward))
        assert agent.status.doubts == agent.status.notes == ()
    env.close()
