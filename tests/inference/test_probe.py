"""The probe finds what is linear in a latent."""

from dataclasses import replace

import numpy as np
import pytest

from rebody.inference.probe import fit_probe, unfitted
from rebody.ranges import Box
from rebody.tasks import FamilySet, Quantity
from rebody.tasks.line import GOAL, VELOCITY
from rebody.types import Belief

SLOPE = np.array([4.0, -2.0, 0.0])
GOALS, BOTH = FamilySet((GOAL,)), FamilySet((GOAL, VELOCITY))
OF_VELOCITY = 1
PLACE = replace(
    GOAL, name="place", quantity=Quantity("xy", ("x", "y"), "m", "place"), targets=(Box((-6.0, -4.0), (6.0, 4.0)),),
    directions=(),
)  # fmt: skip
DOCK = replace(
    PLACE, name="dock", quantity=Quantity("x_yaw_y", ("x", "yaw", "y"), "m, rad", "place and heading"),
    targets=(Box((-6.0, -3.0, -1.0), (6.0, 3.0, 1.0)),),
)  # fmt: skip


def belief(latent, std=1.0):
    return Belief(latent.astype(np.float32), np.full_like(latent, std**2, np.float32))


@pytest.mark.parametrize("family", [GOAL, VELOCITY])
def test_recovers_a_linear_map_of_one_family(family):
    latent = np.random.default_rng(0).normal(size=(200, 3))
    probe = fit_probe(FamilySet((family,)), latent, np.zeros(200, int), (latent @ SLOPE + 1.5)[:, None])
    np.testing.assert_allclose(probe.target_weights[:, 0], [*SLOPE, 1.5], atol=1e-4)
    unseen = np.random.default_rng(1).normal(size=(5, 4, 3))
    families, targets = probe(belief(unseen))
    np.testing.assert_array_equal(families, np.zeros((5, 4)))
    np.testing.assert_allclose(targets[..., 0], unseen @ SLOPE + 1.5, atol=1e-3)


def test_tells_families_apart_and_reads_each_by_its_own_map():
    rng = np.random.default_rng(0)
    family = rng.choice([0, OF_VELOCITY], 400)
    latent = rng.normal(size=(400, 3))
    latent[:, 2] += np.where(family == OF_VELOCITY, 8.0, -8.0)  # apart by 16 standard deviations
    target = np.where(family == OF_VELOCITY, latent[:, 1] - 2.0, latent @ SLOPE)[:, None]
    probe = fit_probe(BOTH, latent[:300], family[:300], target[:300])
    families, targets = probe(belief(latent[300:]))
    np.testing.assert_array_equal(families, family[300:])
    np.testing.assert_allclose(targets, target[300:], atol=1e-3)
    probabilities = np.asarray(probe.probabilities(belief(latent[300:])))
    np.testing.assert_allclose(probabilities.sum(axis=-1), 1.0, atol=1e-5)
    np.testing.assert_array_equal(probabilities.argmax(axis=-1), families)


def test_a_sign_is_as_sure_as_the_belief():
    """target = 2 z + 1 is positive with a chance of Phi((2 m + 1) / (2 s)), where z has mean m and deviation s."""
    z = np.linspace(-3.0, 3.0, 50)[:, None]
    probe = fit_probe(GOALS, z, np.zeros(50, int), 2 * z + 1)
    mean, std = np.array([-0.5, 0.5, 0.5, -2.0]), np.array([1.0, 1.0, 0.1, 0.1])
    [(centre, spread)] = probe.spreads(Belief(mean[:, None].astype("f4"), std[:, None].astype("f4") ** 2))
    np.testing.assert_allclose(centre[:, 0], 2 * mean + 1, atol=1e-3)
    np.testing.assert_allclose(spread[:, 0], 2 * std, atol=1e-3)
    front = [GOAL.direction_chances(*each)[1] for each in zip(np.asarray(centre), np.asarray(spread), strict=True)]
    np.testing.assert_allclose(front, [0.5, 0.8413, 1.0, 0.0], atol=2e-3)


def test_vectors_are_read_number_by_number_and_padded():
    rng = np.random.default_rng(0)
    family = np.arange(400) % 2
    latent = rng.normal(size=(400, 3))
    latent[:, 2] += np.where(family == 1, 8.0, -8.0)
    maps = rng.normal(size=(4, 2))
    with_one = np.concatenate([latent, np.ones((400, 1))], axis=-1)
    target = np.where(family[:, None] == 1, with_one @ maps, with_one @ maps * [1, 0])
    families = FamilySet((GOAL, PLACE))
    probe = fit_probe(families, latent, family, target)
    assert probe.target_weights.shape == (4, 3)
    found, read = probe(belief(latent))
    np.testing.assert_array_equal(found, family)
    np.testing.assert_allclose(read, target, atol=1e-2)
    goals, places = probe.spreads(belief(latent, 0.1))
    assert (goals[0].shape, places[0].shape, places[1].shape) == ((400, 1), (400, 2), (400, 2))
    np.testing.assert_allclose(places[1][0], 0.1 * np.linalg.norm(maps[:3], axis=0), rtol=1e-2)


def test_a_heading_is_read_by_its_sine_and_cosine():
    """All round, where a line would have to break somewhere; with what stands before it and behind."""
    rng = np.random.default_rng(0)
    yaw, x, y = rng.uniform(-np.pi, np.pi, 300), *rng.normal(size=(2, 300))
    latent = np.stack([np.sin(yaw), np.cos(yaw), x, y], axis=-1) @ rng.normal(size=(4, 4))
    target = np.stack([x, yaw, y], axis=-1)
    probe = fit_probe(FamilySet((DOCK,)), latent[:200], np.zeros(200, int), target[:200])
    assert probe.target_weights.shape == (5, 4)
    _, read = probe(belief(latent[200:]))
    np.testing.assert_allclose(DOCK.quantity.difference(np.asarray(read), target[200:]), 0.0, atol=1e-2)
    [(mean, std)] = probe.spreads(belief(latent[200:], 0.01))
    np.testing.assert_allclose(mean, read, atol=1e-5)
    assert std.shape == (100, 3)
    columns = probe.target_weights[:-1][:, [0, 1, 3]]  # of a heading that of its sine
    np.testing.assert_allclose(std[0], 0.01 * np.linalg.norm(columns, axis=0), rtol=1e-3)


def test_one_that_knows_nothing_has_the_same_shapes():
    families = FamilySet((GOAL, DOCK))
    probe, which = unfitted(families, 2), np.arange(40) % 2
    assert (probe.family_weights.shape, probe.target_weights.shape) == ((3, 2), (3, 5))
    rng = np.random.default_rng(0)
    fitted = fit_probe(families, rng.normal(size=(40, 2)), which, rng.normal(size=(40, 3)))
    assert fitted.target_weights.shape == probe.target_weights.shape
    assert fitted.family_weights.shape == probe.family_weights.shape
    np.testing.assert_allclose(probe.probabilities(belief(np.ones((1, 2)))), [[0.5, 0.5]])
