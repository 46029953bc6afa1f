"""One value per slot: the largest is the subgoal, and learning finds both the slot and its value."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.control.places import Place
from rebody.control.sac import Critics, SACBatch, SACConfig, initial_state, update_many
from rebody.control.slot_policy import SOFTNESS, SlotValue, draw, pool, slot_sac, slots_within, subgoal_of
from rebody.ranges import Box, interval
from rebody.tasks import FamilySet, Quantity
from rebody.tasks.line import GOAL, STAND, VELOCITY
from rebody.types import global_state

X, VX, PITCH = (family.quantity for family in (GOAL, VELOCITY, STAND))
SLOTS = (Place(X, (5.0,)), Place(VX, (2.0,)), Place(PITCH, (1.0,)))
TWO = SLOTS[:2]
XY = Quantity("xy_yaw", ("x", "y", "yaw"), "m, rad", "place and heading")
VECTORS = (Place(VX, (2.0,)), Place(XY, (5.0, 4.0, 3.0)))
"""Slots of one number and of three."""
VALUES = np.array([[0.3, -0.4, 0.1], [-0.9, 0.2, 0.8], [0.0, 0.0, 0.0]], np.float32)


def at(x):
    return global_state(x=x)


def test_the_largest_value_stays_with_its_sign():
    np.testing.assert_allclose(pool(VALUES, SLOTS), [[0, -0.4, 0], [-0.9, 0, 0], [0, 0, 0]])


def test_the_longest_vector_stays_as_it_is():
    values = np.array([[0.5, 0.4, -0.4, 0.1], [-0.6, 0.4, -0.4, 0.1]], np.float32)  # of 0.57
    np.testing.assert_allclose(pool(values, VECTORS), [[0, 0.4, -0.4, 0.1], [-0.6, 0, 0, 0]])


def test_a_value_asks_for_the_share_of_what_the_robot_reaches_that_is_its_square():
    """A goal lies that far ahead of where the robot is."""
    x = np.array([10.0, 10.0, 10.0], np.float32)
    subgoal = subgoal_of(pool(VALUES, SLOTS), at(x), SLOTS)
    np.testing.assert_array_equal(subgoal.slot, [1, 0, 0])
    np.testing.assert_allclose(subgoal.value[:, 0], [-0.16 * 2, 10 - 0.81 * 5, 10.0], rtol=1e-6)


def test_a_vector_asks_for_a_point_in_the_world():
    """As far ahead as the square of its length, along each of its numbers."""
    here = global_state(x=np.full(2, 10.0, np.float32), y=np.full(2, -1.0, np.float32), yaw=np.full(2, 0.5, np.float32))
    values = np.array([[0.0, 0.3, -0.4, 0.0], [0.5, 0.0, 0.0, 0.0]], np.float32)
    subgoal = subgoal_of(pool(values, VECTORS), here, VECTORS)
    np.testing.assert_array_equal(subgoal.slot, [1, 0])
    expected = [[10 + 0.15 * 5, -1 - 0.2 * 4, 0.5], [0.25 * 2, 0, 0]]
    np.testing.assert_allclose(subgoal.value, expected, rtol=1e-5)


@pytest.mark.parametrize("names", [("goal",), ("goal", "velocity"), ("stand", "velocity", "goal")])
def test_there_is_a_slot_for_each_family_of_the_module(names):
    told = {"velocity": interval(-1.3, 2.3), "goal": interval(-5.0, 5.0), "stand": interval(-1.0, 0.5)}
    families = FamilySet((GOAL, VELOCITY, STAND))
    commands = FamilySet(tuple(families.named(name).within(box) for name, box in told.items()))
    wanted = {"goal": Place(X, (5.0,)), "velocity": Place(VX, (2.3,)), "stand": Place(PITCH, (1.0,))}
    assert slots_within(families.only(names), commands) == tuple(wanted[name] for name in names)


def test_a_slot_of_several_numbers_has_as_many_scales():
    place = FamilySet(
        (dataclasses.replace(GOAL, quantity=XY, targets=(Box((-5.0, -1.0, -3.0), (4.0, 2.0, 1.0)),), directions=()),)
    )
    assert slots_within(place, place) == (Place(XY, (5.0, 2.0, 3.0)),)


def test_while_it_learns_a_slot_is_drawn_by_its_value():
    keys = jax.random.split(jax.random.key(0), 4000)
    drawn = jax.vmap(lambda key: draw(jnp.array([0.2, -0.1]), TWO, key))(keys)
    first = drawn[:, 0] != 0
    np.testing.assert_allclose(drawn, np.where(first[:, None], [[0.2, 0]], [[0, -0.1]]))
    assert first.mean() == pytest.approx(1 / (1 + np.exp(-0.1 / SOFTNESS)), abs=0.03)


def test_judgement_is_the_mean_over_what_may_be_done():
    """And so is its log-probability: that of a slot, and of the value that is its own."""
    critics = Critics(1 + 2, SACConfig(hidden=(8,)), jax.random.key(0))
    observation, values, log_probs = jnp.array([[0.7]]), jnp.array([[0.2, -0.1]]), jnp.array([[1.0, -3.0]])
    alone = [critics(observation, jnp.array([pooled])) for pooled in ([0.2, 0.0], [0.0, -0.1])]
    chance = 1 / (1 + np.exp(-0.1 / SOFTNESS))
    worth, log_prob = SlotValue(TWO)(critics, observation, values, log_probs)
    np.testing.assert_allclose(worth, (chance * alone[0] + (1 - chance) * alone[1]).min(0), rtol=1e-4)
    expected = chance * (np.log(chance) + 1.0) + (1 - chance) * (np.log(1 - chance) - 3.0)
    np.testing.assert_allclose(log_prob, [expected], rtol=1e-4)


def test_judgement_of_vectors_is_by_their_lengths():
    critics = Critics(1 + 4, SACConfig(hidden=(8,)), jax.random.key(0))
    observation, values = jnp.array([[0.7]]), jnp.array([[0.2, 0.1, 0.2, -0.2]])
    log_probs = jnp.array([[1.0, -3.0, 0.5, 0.5]])
    pooled = [[0.2, 0, 0, 0], [0, 0.1, 0.2, -0.2]]
    alone = [critics(observation, jnp.array([each])) for each in pooled]
    chance = 1 / (1 + np.exp(0.1 / SOFTNESS))  # of a length of 0.2 beside one of 0.3
    worth, log_prob = SlotValue(VECTORS)(critics, observation, values, log_probs)
    np.testing.assert_allclose(worth, (chance * alone[0] + (1 - chance) * alone[1]).min(0), rtol=1e-4)
    expected = chance * (np.log(chance) + 1.0) + (1 - chance) * (np.log(1 - chance) - 2.0)
    np.testing.assert_allclose(log_prob, [expected], rtol=1e-4)


def test_no_slot_is_drawn_for_the_entropy_of_its_value():
    """A value whose slot has next to no chance feels nothing, however sure it is."""
    critics = Critics(1 + 2, SACConfig(hidden=(8,)), jax.random.key(0))
    values = jnp.array([[1.0, 0.0]])

    def log_prob(log_probs):
        return SlotValue(TWO)(critics, jnp.array([[0.7]]), values, log_probs)[1].sum()

    np.testing.assert_allclose(jax.grad(log_prob)(jnp.zeros((1, 2))), [[1.0, 0.0]], atol=1e-4)
    assert slot_sac(SACConfig(target_entropy=-1.0), 4).target_entropy == -0.25


def test_it_learns_which_slot_and_how_much():
    """Two slots that pay most at 0.5 and -0.6, the second twice as much where a sign is seen, else half."""
    rows = 2000
    keys = jax.random.split(jax.random.key(1), 4)
    sign = jnp.where(jax.random.bernoulli(keys[0], shape=(rows,)), 1.0, -1.0)
    values = jax.random.uniform(keys[1], (rows, 2), minval=-1.0)
    action = values * jax.nn.one_hot(jax.random.randint(keys[2], (rows,), 0, 2), 2)
    first, second = 1 - jnp.abs(action[:, 0] - 0.5), 1 - jnp.abs(action[:, 1] + 0.6)
    paid = jnp.where(action[:, 0] != 0, first, (1.5 + sign) / 1.25 * second)
    data = SACBatch(sign[:, None], action, paid, sign[:, None], jnp.ones(rows))
    config = SACConfig(hidden=(32, 32), learning_rate=3e-3, decay_updates=1500, initial_temperature=1e-3, batch_size=64)

    def batch_of(_, key):
        return jax.tree.map(lambda leaf: leaf[jax.random.randint(key, (64,), 0, rows)], data)

    state = initial_state(1, 2, config, keys[3])
    state, _ = update_many(state, batch_of, None, jax.random.split(keys[3], 1500), slot_sac(config, 2), SlotValue(TWO))
    chosen = pool(state.averaged_actor(jnp.array([[1.0], [-1.0]])), TWO)
    np.testing.assert_allclose(chosen, [[0, -0.6], [0.5, 0]], atol=0.1)
