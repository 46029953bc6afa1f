"""The policy that is told its task, learned by gradients through the toy."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.bodies.toys import make_toy
from rebody.control.places import TaskCode, places_of
from rebody.errors import RebodyError
from rebody.tasks.family_set import sample
from rebody.tasks.quantities import length
from rebody.training.inference import PRESETS
from rebody.training.inference.config import ToldConfig
from rebody.training.inference.told import course, initial_told, starts, update_told
from rebody.training.inference.train import load_pretrained
from rebody.types import global_state


@pytest.fixture(scope="module", params=["goal-velocity", "plane"])
def brief(request):
    """A preset that learns for three iterations."""
    preset = PRESETS[request.param]()
    sac = replace(preset.sac, hidden=(64, 64), projections=8)
    told = ToldConfig(updates=200, courses=32)
    return replace(preset, sac=sac, told=told, wander_iterations=0, joint_iterations=3, policy_iterations=0)


def test_it_learns_to_do_its_tasks(brief):
    """In 600 updates: of 15 m, 3 m/s and half a turn, what is left after 10 s is within the tolerances."""
    toy = make_toy(brief.toy)
    state = initial_told(brief, toy, jax.random.key(0))
    earned = []
    for i in range(3):
        state, metrics = update_told(state, toy, brief, jax.random.key(i))
        earned.append(float(metrics["return"]))
    assert earned[2] > earned[0]
    task = sample(brief.families, jax.random.key(9), (100,))
    left = np.asarray(_left_after(100, state.actor, toy, brief, task))
    tolerance = np.array([family.tolerance for family in brief.families])[np.asarray(task.family)]
    assert (left < tolerance).mean() > 0.9


@eqx.filter_jit
def _left_after(decisions, actor, toy, config, task):
    told = TaskCode(places_of(config.families))(task)

    def step(body, _):
        body = toy.step(body, actor(config.told_view(toy.observe(body), told)), jax.random.key(0))
        return body, None

    body = toy.begin(global_state(x=jnp.zeros(len(task.family))))
    body, _ = jax.lax.scan(step, body, None, length=decisions)
    return length(config.families.error(task, toy.observe(body)))


def test_a_course_is_paid_decision_by_decision(brief):
    toy = make_toy(brief.toy)
    actor = initial_told(brief, toy, jax.random.key(0)).actor
    earned = course(actor, toy, brief, jax.random.key(1))
    assert earned.shape == (24, 32)
    assert (np.asarray(earned) <= 0).all()


def test_a_share_starts_near_what_is_asked_for(brief):
    toy, many = make_toy(brief.toy), replace(brief, told=replace(brief.told, near=0.3))
    task = sample(brief.families, jax.random.key(0), (4000,))
    state = starts(task, toy, many, jax.random.key(1))
    for i, family in enumerate(brief.families):
        mine = np.asarray(task.family) == i
        off = family.quantity.difference(
            np.asarray(family.quantity.read(state)), np.asarray(task.target)[:, : family.size]
        )
        is_near = np.all(np.abs(off) <= family.floor, axis=-1)[mine]
        assert 0.27 < is_near.mean() < 0.55  # some are by chance
    assert np.abs(state.x).max() <= brief.start[0] + 1.0 + max(brief.families[0].range.high)


def test_same_key_same_policy(brief):
    toy, short = make_toy(brief.toy), replace(brief, told=ToldConfig(updates=2, courses=4))
    state = initial_told(short, toy, jax.random.key(0))
    one, other = (update_told(state, toy, short, jax.random.key(3))[0] for _ in range(2))
    jax.tree.map(np.testing.assert_array_equal, *(eqx.filter(each, eqx.is_array) for each in (one, other)))


def test_it_goes_on_from_a_policy_of_its_size(brief):
    toy = make_toy(brief.toy)
    state = initial_told(brief, toy, jax.random.key(0))
    other = initial_told(brief, toy, jax.random.key(1)).actor
    jax.tree.map(np.testing.assert_array_equal, load_pretrained(other, state.actor, "x"), other)
    small = initial_told(replace(brief, sac=replace(brief.sac, hidden=(8,))), toy, jax.random.key(0)).actor
    with pytest.raises(RebodyError, match="cannot start from 'x': its networks have other sizes"):
        load_pretrained(small, state.actor, "x")
