"""The picture of the latent."""

import numpy as np
import pytest

from rebody.agents.belief import Reading
from rebody.inference.mixture.estimator import DirichletProcessMixture
from rebody.inference.mixture.padded import mixture_prior
from rebody.tasks import SHIPPED
from rebody.types import Belief
from rebody.viewer.latent import LatentPicture, component, plane_of

CENTRES = np.array([[6.0, 0.0, 0.0], [0.0, 6.0, 0.0], [0.0, 0.0, 6.0]])


@pytest.fixture(scope="module")
def mixture():
    """Three clusters in three dimensions, padded to five."""
    points = CENTRES[:, None] + np.random.default_rng(0).normal(0, [0.5, 0.5, 1.0], (3, 400, 3))
    return mixture_prior(DirichletProcessMixture(random_state=0).fit(points.reshape(-1, 3)), 5)


def active(mixture) -> list[int]:
    return np.flatnonzero(mixture.active).tolist()


def reading(mean: list[float], responsibilities: dict[int, float], family: str = "goal") -> Reading:
    latent = Belief(np.array(mean), np.full(len(mean), 0.04))
    return Reading(family, (1.0,), np.eye(1), {("goal", "front"): 1.0, ("goal", "back"): 0.0}, responsibilities, latent)


def test_a_component_is_where_its_points_are(mixture):
    means, covariances = zip(*(component(mixture, k, latent=4) for k in active(mixture)), strict=True)
    order = np.argmax(means, axis=1)
    np.testing.assert_allclose(np.array(means)[np.argsort(order), :3], CENTRES, atol=0.2)
    for covariance in covariances:
        np.testing.assert_allclose(np.diag(covariance), [0.25, 0.25, 1.0, 0.0], rtol=0.2)


def test_more_clustered_dimensions_than_two_are_seen_from_where_the_clusters_lie_apart(mixture):
    plane = plane_of(4, mixture)
    seen = plane.points(np.column_stack([CENTRES, np.zeros(3)]))
    apart = np.linalg.norm(seen - np.roll(seen, 1, axis=0), axis=1)
    np.testing.assert_allclose(apart, 6 * 2**0.5, rtol=0.02)
    np.testing.assert_allclose(plane.directions.T @ plane.directions, np.eye(2), atol=1e-9)


def test_without_clusters_the_first_two_numbers_are_seen():
    assert plane_of(3, None).points(np.array([1.0, 2.0, 3.0])).tolist() == [1.0, 2.0]
    assert plane_of(1, None).points(np.array([1.0])).tolist() == [1.0, 0.0]


def test_the_picture_shows_the_belief_and_whose_it_is(mixture):
    picture = LatentPicture(4, mixture, SHIPPED)
    first, second = active(mixture)[:2]
    shares = {k: float(k == first) for k in active(mixture)}
    others = {k: float(k == second) for k in shares}
    empty, here = picture.draw([]), picture.draw([reading([6.0, 0.0, 0.0, 0.0], shares)])
    there = picture.draw([reading([0.0, 6.0, 0.0, 0.0], shares)])
    elsewhere = picture.draw([reading([6.0, 0.0, 0.0, 0.0], others)])
    for other in (empty, there, elsewhere):
        assert (here != other).any()
    again = picture.draw([reading([6.0, 0.0, 0.0, 0.0], shares)])
    np.testing.assert_array_equal(here, again)  # nothing is left of what was drawn between


def test_a_belief_far_away_gets_room():
    picture = LatentPicture(2, None, SHIPPED)
    far = picture.draw([reading([50.0, 3.0], {}, family="velocity")])
    green = (np.abs(far.astype(int) - [0x3F, 0x8F, 0x63]) < 10).all(axis=-1)
    assert green.sum() > 20
