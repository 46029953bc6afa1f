"""Roots of information matrices, against NumPy in double precision."""

import jax.numpy as jnp
import numpy as np

from rebody.inference.roots import log_determinant, root_of, solved, variance_along

SLOPES = np.random.default_rng(0).normal(size=(9, 3))
INFORMATION = SLOPES.T @ SLOPES


def test_a_root_is_that_of_the_information():
    root = np.asarray(root_of(jnp.asarray(SLOPES[:4], jnp.float32), jnp.asarray(SLOPES[4:], jnp.float32)))
    np.testing.assert_allclose(root.T @ root, INFORMATION, rtol=1e-4, atol=1e-5)
    assert not np.tril(root, -1).any()
    np.testing.assert_allclose(log_determinant(root), np.linalg.slogdet(INFORMATION)[1], rtol=1e-4)


def test_what_is_solved_and_how_far_numbers_vary():
    root = root_of(jnp.asarray(SLOPES, jnp.float32))
    np.testing.assert_allclose(solved(root, jnp.ones(3)), np.linalg.solve(INFORMATION, np.ones(3)), rtol=1e-4)
    along = np.array([[1.0, 0.0, 0.0], [0.5, -1.0, 2.0]])
    wanted = np.diagonal(along @ np.linalg.inv(INFORMATION) @ along.T)
    np.testing.assert_allclose(variance_along(root, jnp.asarray(along, jnp.float32)), wanted, rtol=1e-4)


def test_small_directions_are_not_lost_beside_large_ones():
    """Information of 1e12 beside 1: float32 would lose the one of them in their sum."""
    root = root_of(jnp.asarray([[1e6, 1e6]], jnp.float32), jnp.eye(2))
    np.testing.assert_allclose(log_determinant(root), np.log(2e12), rtol=1e-3)
    np.testing.assert_allclose(variance_along(root, jnp.asarray([[1.0, -1.0]])), 2.0, rtol=1e-2)
