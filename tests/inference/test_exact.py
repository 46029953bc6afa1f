"""The exact posterior: Bayes' rule by brute force, and what a yardstick must be able to do."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from rebody.inference.exact import (
    CHANGE_PROBABILITY,
    FEW,
    REWARD_STD,
    TARGETS,
    ExactPosterior,
    exact_posterior,
    read_mode,
)
from rebody.ranges import Box, interval
from rebody.tasks import FamilySet, Quantity
from rebody.tasks.line import GOAL, STAND, VELOCITY
from rebody.types import Task, Transition, global_state

PLAIN = FamilySet((GOAL.within(interval(-10.0, 10.0), law="plain"), VELOCITY.within(interval(-3.0, 3.0), law="plain")))
GOALS = PLAIN.only(("goal",))
OF_GOAL, OF_VELOCITY = 0, 1
POINTS = TARGETS[1]
SPACING = 20.0 / (POINTS - 1)


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
    task = Task(np.full(state.x.shape, family), np.full((*state.x.shape, 1), target, np.float32))
    return np.asarray(PLAIN.reward(task, state))


@pytest.mark.parametrize("law", ["plain", "relative"])
def test_it_is_bayes_rule(law):
    """Against products of likelihoods in double precision, on a grid so fine that it stays in doubt."""
    family = np.repeat([OF_GOAL, OF_VELOCITY], [41, 21]).astype(np.int32)
    target = np.concatenate([np.linspace(1.9, 2.1, 41), np.linspace(-0.1, 0.1, 21)]).astype(np.float32)
    rng = np.random.default_rng(0)
    x, vx = rng.uniform(-0.02, 0.02, (2, 6, 3)).astype(np.float32)
    floor = np.where(family == OF_GOAL, 1.0, 0.5)
    scale = np.maximum(np.abs(target.astype(float)), floor) if law == "relative" else 1.0
    pays = -np.abs(np.where(family == OF_GOAL, x[..., None], vx[..., None]) - target.astype(float)) / scale
    earned = (pays[..., 20] + REWARD_STD * rng.standard_normal((6, 3))).astype(np.float32)
    earned[4:] = (pays[4:, :, 50] + REWARD_STD * rng.standard_normal((2, 3))).astype(np.float32)  # another task

    states = [at(*where) for where in zip(x, vx, strict=True)]
    families = FamilySet(tuple(replace(each, law=law) for each in PLAIN))
    found, _ = listen(ExactPosterior(Task(family, target[:, None]), families), states, earned)
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
    posterior = exact_posterior(GOALS)
    xs = (0.0, 0.5)
    log_posteriors, beliefs = listen(posterior, [at(x) for x in xs], [paid(OF_GOAL, target, x) for x in xs])
    right = np.sign(posterior.grid.target[:, 0]) == np.sign(target)
    assert np.exp(log_posteriors[0])[right].sum() == pytest.approx(0.5, abs=0.01)
    assert abs(float(beliefs[0].mean[1])) == pytest.approx(abs(target), abs=1.01 * SPACING)
    family, found = read_mode(beliefs[1])
    assert (int(family), float(found[0])) == (OF_GOAL, pytest.approx(target, abs=1.01 * SPACING))
    assert float(beliefs[1].variance[0]) < float(beliefs[0].variance[0]) - 0.1


@pytest.mark.parametrize(("family", "target"), [(OF_GOAL, 2.0), (OF_VELOCITY, -1.5), (OF_VELOCITY, 2.4)])
def test_it_tells_families_apart(family, target):
    xs, vxs = (0.0, 0.4, 0.9), (0.0, 1.0, 0.2)
    posterior = exact_posterior(PLAIN)
    states = [at(x, vx) for x, vx in zip(xs, vxs, strict=True)]
    _, beliefs = listen(posterior, states, [paid(family, target, s.x, s.vx) for s in states])
    found_family, found = read_mode(beliefs[-1])
    assert int(found_family) == family
    assert float(found[0]) == pytest.approx(target, abs=1.01 * SPACING)


def test_it_follows_a_task_that_changes():
    posterior = exact_posterior(GOALS)
    xs = 0.2 * np.arange(40)
    targets = np.where(np.arange(40) < 30, 3.0, -4.0)
    rewards = [paid(OF_GOAL, target, x) for x, target in zip(xs, targets, strict=True)]
    _, beliefs = listen(posterior, [at(x) for x in xs], rewards)
    found = np.array([float(read_mode(belief)[1][0]) for belief in beliefs])
    np.testing.assert_allclose(found[2:30], 3.0, atol=1.01 * SPACING)
    np.testing.assert_allclose(found[32:], -4.0, atol=1.01 * SPACING)


def test_a_tie_goes_to_the_task_that_asks_least():
    goals, speeds = FamilySet((GOAL.within(interval(2.0, 15.0)),)), FamilySet((VELOCITY.within(interval(-3.0, -1.0)),))
    for families, least in ((PLAIN, 0.0), (goals, 2.0), (speeds, -1.0)):
        assert float(read_mode(exact_posterior(families).prior())[1][0]) == least
    posterior = exact_posterior(GOALS)
    for x, nearer in ((5.0, 3.0), (-5.0, -3.0)):
        _, (belief,) = listen(posterior, [at(x)], [np.float32(-2.0)])
        assert float(read_mode(belief)[1][0]) == pytest.approx(nearer, abs=1e-5)  # not 7


def test_nothing_is_known_before_the_first_reward():
    posterior = exact_posterior(PLAIN)
    probability = np.exp(posterior.initial((4, 3)))
    assert probability.shape == (4, 3, 2 * POINTS)
    np.testing.assert_allclose(probability, 1 / (2 * POINTS), rtol=1e-4)
    prior = posterior.prior((4, 3))
    assert prior.mean.shape == prior.variance.shape == (4, 3, 2)
    np.testing.assert_allclose(prior.variance, 1.0, atol=1e-3)


def test_episodes_do_not_hear_each_other():
    posterior = exact_posterior(PLAIN)
    xs, targets = np.array([[0.0, 0.3], [0.5, 1.0]], np.float32), np.array([4.0, -6.0], np.float32)
    together, _ = listen(posterior, [at(x) for x in xs], [-np.abs(x - targets) for x in xs])
    for i in range(2):
        alone, _ = listen(posterior, [at(x[i]) for x in xs], [-np.abs(x[i] - targets[i]) for x in xs])
        jax.tree.map(lambda a, b, i=i: np.testing.assert_allclose(a, b[i], rtol=1e-5, atol=1e-3), alone, together)


PLACE = replace(
    GOAL, name="place", quantity=Quantity("xy", ("x", "y"), "m", "place"), targets=(Box((-6.0, -4.0), (6.0, 4.0)),),
    directions=(),
)  # fmt: skip
DOCK = replace(
    PLACE, name="dock", quantity=Quantity("x_yaw", ("x", "yaw"), "m, rad", "place and heading"), law="plain",
    targets=(Box((-6.0, -3.0), (6.0, 3.0)),),
)  # fmt: skip


def found_by(families, task, walk):
    """Family and target after a walk: fields, each [time]."""
    posterior = exact_posterior(families)
    memory = posterior.initial()
    for numbers in zip(*walk.values(), strict=True):
        state = global_state(**{n: np.asarray(value, np.float32) for n, value in zip(walk, numbers, strict=True)})
        memory, belief = posterior.step(memory, transition(state, families.reward(task, state)))
    family, target = read_mode(belief)
    return families[family].name, np.asarray(target)


@pytest.mark.parametrize("target", [(3.3, -2.6), (-5.9, 0.1), (0.0, 3.9)])
@pytest.mark.parametrize("law", ["plain", "relative"])
def test_three_rewards_pin_down_a_place(target, law):
    """To the next point of its grid, whose points are 12 cm and 8 cm apart."""
    families = FamilySet((replace(PLACE, law=law), replace(GOAL, law=law), replace(VELOCITY, law=law)))
    walk = {"x": (0.0, 0.6, 0.9, 0.4), "y": (0.0, 0.1, -0.7, 0.5), "vx": (0.0, 2.0, 1.0, -1.0)}
    grid = (0.12 * round(target[0] / 0.12), 0.08 * round(target[1] / 0.08))
    name, found = found_by(families, families.task("place", grid), walk)
    assert name == "place"
    np.testing.assert_allclose(found, grid, atol=1e-4)
    name, found = found_by(families, families.task("goal", -4.0), walk)
    assert (name, found[1]) == ("goal", 0.0)
    assert found[0] == pytest.approx(-4.0, abs=1.01 * 30 / (POINTS - 1))


def test_a_target_between_the_points_of_the_grid_is_found_as_near_as_can_be():
    families = FamilySet((PLACE,))
    walk = {"x": np.linspace(0.0, 3.0, 20), "y": np.sin(np.arange(20.0))}
    _, found = found_by(families, families.task("place", (3.37, -2.61)), walk)
    np.testing.assert_allclose(found, (3.37, -2.61), atol=0.13)


@pytest.mark.parametrize("heading", [3.0, -3.0, 0.3])
def test_a_heading_is_found_the_shorter_way_round(heading):
    families = FamilySet((DOCK, replace(STAND, law="plain")))
    walk = {"x": (0.0, 0.6, 0.9, 0.5), "yaw": (2.9, -3.1, 2.0, 0.5), "pitch": (0.0, 0.3, 0.1, 0.2)}
    name, found = found_by(families, families.task("dock", (1.2, heading)), walk)
    assert name == "dock"
    np.testing.assert_allclose(found, (1.2, heading), atol=1e-4)


def test_a_grid_has_fewer_points_along_each_axis_the_more_there_are():
    whole = replace(
        PLACE, quantity=Quantity("xyzyaw", ("x", "y", "z", "yaw"), "m", "pose"),
        targets=(Box((-1.0,) * 4, (1.0,) * 4),),
    )  # fmt: skip
    assert len(exact_posterior(FamilySet((PLACE,))).grid.target) == TARGETS[2] ** 2
    assert exact_posterior(FamilySet((whole,))).grid.target.shape == (FEW**4, 4)
    mixed = exact_posterior(FamilySet((GOAL, PLACE)))
    assert not mixed.grid.target[mixed.grid.family == 0, 1].any()
