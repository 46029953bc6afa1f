"""The probe finds what is linear in a latent."""

import numpy as np
import pytest

from rebody.inference.probe import fit_probe
from rebody.tasks import GOAL, VELOCITY
from rebody.types import Belief

SLOPE = np.array([4.0, -2.0, 0.0])


def belief(latent):
    return Belief(latent.astype(np.float32), np.ones_like(latent, np.float32))


@pytest.mark.parametrize("family", [GOAL, VELOCITY])
def test_recovers_a_linear_map_of_one_family(family):
    latent = np.random.default_rng(0).normal(size=(200, 3))
    probe = fit_probe(latent, np.full(200, family), latent @ SLOPE + 1.5)
    np.testing.assert_allclose(probe.target_weights[:, 0], [*SLOPE, 1.5], atol=1e-4)
    unseen = np.random.default_rng(1).normal(size=(5, 4, 3))
    families, targets = probe(belief(unseen))
    np.testing.assert_array_equal(families, np.full((5, 4), family))
    np.testing.assert_allclose(targets, unseen @ SLOPE + 1.5, atol=1e-3)


def test_tells_families_apart_and_reads_each_by_its_own_map():
    rng = np.random.default_rng(0)
    family = rng.choice([GOAL, VELOCITY], 400)
    latent = rng.normal(size=(400, 3))
    latent[:, 2] += np.where(family == VELOCITY, 8.0, -8.0)  # apart by 16 standard deviations
    target = np.where(family == VELOCITY, latent[:, 1] - 2.0, latent @ SLOPE)
    probe = fit_probe(latent[:300], family[:300], target[:300])
    families, targets = probe(belief(latent[300:]))
    np.testing.assert_array_equal(families, family[300:])
    np.testing.assert_allclose(targets, target[300:], atol=1e-3)
    probabilities = np.asarray(probe.probabilities(belief(latent[300:])))
    np.testing.assert_allclose(probabilities.sum(axis=-1), 1.0, atol=1e-5)
    np.testing.assert_array_equal(probe.families[probabilities.argmax(axis=-1)], families)


def test_a_sign_is_as_sure_as_the_belief():
    """target = 2 z + 1 is positive with a chance of Phi((2 m + 1) / (2 s)), where z has mean m and deviation s."""
    z = np.linspace(-3.0, 3.0, 50)[:, None]
    probe = fit_probe(z, np.full(50, GOAL), 2 * z[:, 0] + 1)
    mean, std = np.array([-0.5, 0.5, 0.5, -2.0]), np.array([1.0, 1.0, 0.1, 0.1])
    [front] = np.asarray(probe.chances_of_front(Belief(mean[:, None], std[:, None] ** 2))).T
    np.testing.assert_allclose(front, [0.5, 0.8413, 1.0, 0.0], atol=1e-3)
