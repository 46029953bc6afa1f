"""How sure a belief is of its target: what the rewards leave open, and no more."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.agents.parts import load_inference
from rebody.inference.covariance import believed_covariances
from rebody.types import Belief

PLACE = np.array([4.0, 3.0])


@pytest.fixture(scope="module")
def plane():
    return load_inference("plane")


def listened(plane, states, place=PLACE):
    """Readings of a walk through places at 1 m/s, paid for the distance from a place."""
    belief = plane.begin({"x": 0.0, "y": 0.0, "yaw": 0.0, "vx": 0.0, "vy": 0.0}, True)
    readings, before = [], np.zeros(2)
    for here in states:
        vx, vy = (here - before) / 0.1
        reward = -float(np.linalg.norm(here - place) / np.linalg.norm(place))
        state = {"x": here[0], "y": here[1], "yaw": 0.0, "vx": float(vx), "vy": float(vy)}
        readings.append(belief.update(state, reward))
        before = here
    return readings


def test_a_straight_walk_leaves_open_what_lies_across_and_a_turn_settles_it(plane):
    """The distance along the path is soon known; how far to the side the place is, is not."""
    straight = np.stack([0.1 * np.arange(1, 13), np.zeros(12)], axis=-1)
    turned = np.concatenate([straight, straight[-1] + np.stack([np.zeros(12), 0.1 * np.arange(1, 13)], axis=-1)])
    readings = listened(plane, turned)
    early, late = readings[9], readings[-1]
    assert early.family == late.family == "place"
    values, _ = np.linalg.eigh(early.covariance)
    assert values[1] > 20 * values[0]  # long and thin
    assert np.sqrt(np.trace(late.covariance)) < 0.3 * np.sqrt(np.trace(early.covariance))
    np.testing.assert_allclose(late.target, PLACE, atol=0.05)
    for reading in readings:
        assert np.isfinite(reading.covariance).all()
        np.testing.assert_allclose(reading.covariance, reading.covariance.T, rtol=1e-3, atol=1e-6)
        assert np.linalg.eigvalsh(reading.covariance).min() > -1e-6


def test_the_diagonal_is_the_reader_s_own_variance(inference):
    reader = inference.parts.probe
    belief = Belief(jnp.array([0.4, -1.2]), jnp.array([0.3, 0.02]))
    (covariance,) = believed_covariances(reader, belief)
    ((_, deviation),) = reader.spreads(belief)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), deviation, rtol=1e-5)
    assert jax.tree.map(np.shape, covariance) == (1, 1)
