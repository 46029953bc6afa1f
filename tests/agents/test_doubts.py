"""Rewards in another form, scale or unit than the module learned are doubted; those of real gaits are not."""

import itertools

import numpy as np
import pytest

import rebody
from rebody.agents.doubts import RewardWatch, _is_beyond
from rebody.types import global_state


def run_towards(target: float, speed: float = 1.5, decisions: int = 60):
    """x and vx of a body that runs to a goal unevenly, as a gait does, and stops there."""
    x = np.zeros(decisions + 1)
    for i in range(decisions):
        wanted = np.clip(target - x[i], -speed, speed)
        x[i + 1] = x[i] + 0.1 * wanted * (1 + 0.2 * np.sin(i))
    return x, np.diff(x, prepend=0.0) / 0.1


def states(x, vx):
    return [global_state(x=np.asarray(a, np.float32), vx=np.asarray(b, np.float32)) for a, b in zip(x, vx)]  # noqa: B905


@pytest.fixture(scope="module")
def module():
    return rebody.load_inference("goal-velocity")


def heard(module, pay, target=8.0):
    """The watch over a run, and which of its rewards could be believed."""
    x, vx = run_towards(target)
    watch, at = RewardWatch(module.contract), states(x, vx)
    believed = [watch.hear(a, b, float(pay(x[i + 1], i))) for i, (a, b) in enumerate(itertools.pairwise(at))]
    return watch, np.array(believed)


def relative(x, i):
    return -abs(x - 8.0) / 8.0


def test_the_reward_that_was_learned_is_not_doubted(module):
    watch, believed = heard(module, relative)
    assert believed.all()
    assert watch.doubts(np.inf) == watch.notes(np.inf) == ()


@pytest.mark.parametrize(
    ("pay", "says"),
    [
        (lambda x, i: 100 * relative(x, i), "no target of goal or velocity pays"),
        (lambda x, i: 8 * relative(x, i), "no target of goal or velocity pays"),  # in metres
        (lambda x, i: 1 + relative(x, i), "without bonuses"),
        (lambda x, i: -9999.0 if i == 20 else relative(x, i), "the reward was -1e+04 in 1 decision,"),
        (lambda x, i: 0.0, "the same to the last digit, though the body moved"),
        (lambda x, i: 7.0, "the reward was 7 in 60 decisions"),
    ],
)
def test_rewards_of_another_kind_are_doubted(pay, says, module):
    watch, believed = heard(module, pay)
    assert not believed.all()
    assert any(says in doubt for doubt in watch.doubts(np.inf))


def test_a_doubt_is_forgotten_after_a_while(module):
    watch, _ = heard(module, lambda x, i: 7.0 if i == 0 else relative(x, i))
    assert watch.doubts(np.inf)
    assert watch.doubts() == ()


@pytest.mark.parametrize(("reward", "beyond"), [(2.4, False), (2.6, True), (0.7, True), (0.8, False), (-0.5, True)])
def test_rewards_may_be_good(reward, beyond):
    """Bounds of either sign are let out by a quarter."""
    assert _is_beyond(reward, (1.0, 2.0)) is beyond


def test_beyond_the_trained_range_is_a_note_alone():
    module = rebody.load_inference("position")  # metres, goals within 10 m
    watch, believed = heard(module, lambda x, i: -abs(x - 40.0))
    assert believed.all()
    assert watch.doubts(np.inf) == ()
    (note,) = watch.notes(np.inf)
    assert "is the task outside of its ranges?" in note
