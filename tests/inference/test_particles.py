"""The posterior by particles: what a yardstick in the plane must be able to do."""

import equinox as eqx
import jax
import numpy as np
import pytest

from rebody.inference.exact import read_mode
from rebody.inference.particles import HEARD, ParticlePosterior, target_at
from rebody.ranges import Box
from rebody.tasks.plane import PLANE
from rebody.types import Transition, global_state

POSTERIOR = ParticlePosterior(PLANE)
STEP = eqx.filter_jit(POSTERIOR.step)


def walk(decisions, seed=0):
    """States of a body that wanders and turns."""
    rng = np.random.default_rng(seed)
    velocity = np.cumsum(rng.normal(0.0, 0.4, (decisions, 2)), axis=0)
    x, y = 0.1 * np.cumsum(velocity, axis=0).T
    yaw = np.angle(np.exp(1j * np.cumsum(rng.normal(0.0, 0.3, decisions))))
    fields = {"x": x, "y": y, "vx": velocity[:, 0], "vy": velocity[:, 1], "yaw": yaw}
    return [
        global_state(**{n: np.asarray(each[i], np.float32) for n, each in fields.items()}) for i in range(decisions)
    ]


def listen(states, task, memory=None):
    """Family and target after rewards of a task, and the memory."""
    memory, belief = POSTERIOR.initial() if memory is None else memory, POSTERIOR.prior()
    for state in states:
        memory, belief = STEP(memory, Transition(states[0], np.asarray(PLANE.reward(task, state), np.float32), state))
    family, target = read_mode(belief)
    return PLANE[int(family)].name, np.asarray(target), memory


@pytest.mark.parametrize(
    ("name", "target"),
    [("place", (-6.3, 9.1)), ("place", (2.2, -0.4)), ("velocity_xy", (-0.3, 1.7)), ("heading", 3.1), ("heading", -0.9)],
)
def test_a_task_of_the_plane_is_found_to_the_millimetre(name, target):
    found, where, _ = listen(walk(20), PLANE.task(name, target))
    assert found == name
    np.testing.assert_allclose(where, PLANE.task(name, target).target, atol=1e-3)


def test_it_follows_a_task_that_changes():
    states = walk(40)
    _, _, memory = listen(states[:20], PLANE.task("place", (5.0, 5.0)))
    found, where, _ = listen(states[20:32], PLANE.task("velocity_xy", (0.5, -1.0)), memory)
    assert found == "velocity_xy"
    np.testing.assert_allclose(where, (0.5, -1.0), atol=1e-3)


def test_more_rewards_than_are_kept_stand_for_each_other():
    states = walk(HEARD + 10)
    name, where, memory = listen(states, PLANE.task("place", (7.0, -3.0)))
    assert name == "place"
    np.testing.assert_allclose(where, (7.0, -3.0), atol=1e-3)
    assert float(memory.heard.stands_for.sum()) == HEARD + 10
    assert np.flatnonzero(memory.heard.stands_for).tolist() == list(range(HEARD // 2 + 10))


def test_bodies_do_not_hear_each_other():
    states, task = walk(6), PLANE.task("place", (4.0, 4.0))
    many = POSTERIOR.initial((2,))
    for i, state in enumerate(states):
        both = jax.tree.map(lambda a, b: np.stack([a, b]), state, states[-1 - i])
        reward = np.asarray([PLANE.reward(task, state), -1.0], np.float32)
        many, belief = STEP(many, Transition(both, reward, both))
    _, alone, _ = listen(states, task)
    np.testing.assert_allclose(read_mode(belief)[1][0], alone, atol=1e-4)


def test_a_ring_is_told_by_length_and_bearing():
    ring = Box((2.0, -np.pi), (4.0, np.pi), polar=True)
    np.testing.assert_allclose(target_at(ring, np.array([0.5, 0.75], np.float32)), (0.0, 3.0), atol=1e-5)
