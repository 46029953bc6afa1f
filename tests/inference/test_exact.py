"""The exact posterior: Bayes' rule by brute force, and what a yardstick must be able to do."""

import jax
import numpy as np
import pytest

from rebody.inference.exact import (
    CHANGE_PROBABILITY,
    REWARD_STD,
    TARGETS,
    ExactPosterior,
    exact_posterior,
    read_mode,
)
from rebody.tasks import GOAL, VELOCITY, reward
from rebody.types import Task, Transition, global_state

RANGES = {"goal": (-10.0, 10.0), "velocity": (-3.0, 3.0)}
SPACING = 20.0 / (TARGETS - 1)


def at(x, vx=0.0):
    x, vx = np.broadcast_arrays(np.float32(x), np.float32(vx))
    return global_state(x=x, vx=vx)


def transition(state, earned):
    return Transition(at(np.zeros_like(state.x)), np.asarray(earned, np.float32), state)


def listen(posterior, states, rewards):
    """Log-probabilities and beliefs after each of several transitions."""
    memory, log_posteriors, beliefs = posterior.initial(np.shape(rewards[0])), [], []
    for state, earned in zip(states, rewards, strict=True):
        memory, belief = posterior.step(memory, transition(state, earned))
        log_posteriors.append(np.asarray(memory))
        beliefs.append(belief)
    return log_posteriors, beliefs


def paid(family, target, x, vx=0.0):
    """What a task pays there."""
    state = at(x, vx)
    task = Task(np.full(state.x.shape, family), np.full(state.x.shape, target, np.float32))
    return np.asarray(reward(task, state, "plain"))


@pytest.mark.parametrize("form", ["plain", "relative"])
def test_it_is_bayes_rule(form):
    """Against products of likelihoods in double precision, on a grid so fine that it stays in doubt."""
    family = np.repeat([GOAL, VELOCITY], [41, 21]).astype(np.int32)
    target = np.concatenate([np.linspace(1.9, 2.1, 41), np.linspace(-0.1, 0.1, 21)]).astype(np.float32)
    rng = np.random.default_rng(0)
    x, vx = rng.uniform(-0.02, 0.02, (2, 6, 3)).astype(np.float32)
    floor = np.where(family == GOAL, 1.0, 0.5)
    scale = np.maximum(np.abs(target.astype(float)), floor) if form == "relative" else 1.0
    pays = -np.abs(np.where(family == GOAL, x[..., None], vx[..., None]) - target.astype(float)) / scale
    earned = (pays[..., 20] + REWARD_STD * rng.standard_normal((6, 3))).astype(np.float32)
    earned[4:] = (pays[4:, :, 50] + REWARD_STD * rng.standard_normal((2, 3))).astype(np.float32)  # another task

    states = [at(*where) for where in zip(x, vx, strict=True)]
    found, _ = listen(ExactPosterior(Task(family, target), form), states, earned)
    probability = np.full((3, len(family)), 1 / len(family))
    for i in range(6):
        changed = (1 - CHANGE_PROBABILITY) * probability + CHANGE_PROBABILITY / len(family)
        probability = changed * np.exp(-0.5 * ((earned[i, :, None] - pays[i]) / REWARD_STD) ** 2)
        probability /= probability.sum(-1, keepdims=True)
        np.testing.assert_allclose(np.exp(found[i]), probability, atol=2e-3)
    assert np.max(probability) < 0.9
    assert np.exp(found[3])[:, :41].sum(-1).min() > 0.99  # first a goal, then a speed
    assert np.exp(found[5])[:, 41:].sum(-1).min() > 0.99


@pytest.mark.parametrize("target", [3.37, -3.37, 9.99, 0.05])
def test_two_rewards_pin_down_a_goal(target):
    """The first leaves the side open, which half of the probability stands for."""
    posterior = exact_posterior({"goal": RANGES["goal"]}, "plain")
    xs = (0.0, 0.5)
    log_posteriors, beliefs = listen(posterior, [at(x) for x in xs], [paid(GOAL, target, x) for x in xs])
    right = np.sign(posterior.grid.target) == np.sign(target)
    assert np.exp(log_posteriors[0])[right].sum() == pytest.approx(0.5, abs=0.01)
    assert abs(float(beliefs[0].mean[1])) == pytest.approx(abs(target), abs=1.01 * SPACING)
    family, found = read_mode(beliefs[1])
    assert (int(family), float(found)) == (GOAL, pytest.approx(target, abs=1.01 * SPACING))
    assert float(beliefs[1].variance[0]) < float(beliefs[0].variance[0]) - 0.1


@pytest.mark.parametrize(("family", "target"), [(GOAL, 2.0), (VELOCITY, -1.5), (VELOCITY, 2.4)])
def test_it_tells_families_apart(family, target):
    xs, vxs = (0.0, 0.4, 0.9), (0.0, 1.0, 0.2)
    posterior = exact_posterior(RANGES, "plain")
    states = [at(x, vx) for x, vx in zip(xs, vxs, strict=True)]
    _, beliefs = listen(posterior, states, [paid(family, target, s.x, s.vx) for s in states])
    found_family, found = read_mode(beliefs[-1])
    assert int(found_family) == family
    assert float(found) == pytest.approx(target, abs=1.01 * SPACING)


def test_it_follows_a_task_that_changes():
    posterior = exact_posterior({"goal": RANGES["goal"]}, "plain")
    xs = 0.2 * np.arange(40)
    targets = np.where(np.arange(40) < 30, 3.0, -4.0)
    rewards = [paid(GOAL, target, x) for x, target in zip(xs, targets, strict=True)]
    _, beliefs = listen(posterior, [at(x) for x in xs], rewards)
    found = np.array([float(read_mode(belief)[1]) for belief in beliefs])
    np.testing.assert_allclose(found[2:30], 3.0, atol=1.01 * SPACING)
    np.testing.assert_allclose(found[32:], -4.0, atol=1.01 * SPACING)


def test_a_tie_goes_to_the_task_that_asks_least():
    for ranges, least in ((RANGES, 0.0), ({"goal": (2.0, 15.0)}, 2.0), ({"velocity": (-3.0, -1.0)}, -1.0)):
        assert float(read_mode(exact_posterior(ranges, "plain").prior())[1]) == least
    posterior = exact_posterior({"goal": RANGES["goal"]}, "plain")
    for x, nearer in ((5.0, 3.0), (-5.0, -3.0)):
        _, (belief,) = listen(posterior, [at(x)], [np.float32(-2.0)])
        assert float(read_mode(belief)[1]) == pytest.approx(nearer, abs=1e-5)  # not 7


def test_nothing_is_known_before_the_first_reward():
    posterior = exact_posterior(RANGES, "plain")
    probability = np.exp(posterior.initial((4, 3)))
    assert probability.shape == (4, 3, 2 * TARGETS)
    np.testing.assert_allclose(probability, 1 / (2 * TARGETS), rtol=1e-4)
    prior = posterior.prior((4, 3))
    assert prior.mean.shape == prior.variance.shape == (4, 3, 2)
    np.testing.assert_allclose(prior.variance, 1.0, atol=1e-3)


def test_episodes_do_not_hear_each_other():
    posterior = exact_posterior(RANGES, "plain")
    xs, targets = np.array([[0.0, 0.3], [0.5, 1.0]], np.float32), np.array([4.0, -6.0], np.float32)
    together, _ = listen(posterior, [at(x) for x in xs], [-np.abs(x - targets) for x in xs])
    for i in range(2):
        alone, _ = listen(posterior, [at(x[i]) for x in xs], [-np.abs(x[i] - targets[i]) for x in xs])
        jax.tree.map(lambda a, b, i=i: np.testing.assert_allclose(a, b[i], rtol=1e-5, atol=1e-3), alone, together)
