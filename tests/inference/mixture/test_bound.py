"""The ELBO never falls, whatever the points."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rebody.inference.mixture import DirichletProcessMixture


@st.composite
def point_sets(draw):
    """Clusters near and far, thin and wide, with what makes covariances degenerate."""
    n = draw(st.sampled_from([1, 2, 3, 7, 30, 120]))
    d = draw(st.integers(1, 8))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    k = draw(st.integers(1, 5))
    far = 10.0 ** rng.uniform(-3, draw(st.sampled_from([0, 3, 6])))
    centres = rng.normal(size=(k, d)) * far
    widths = 10.0 ** rng.uniform(-6, 2, size=(k, d))
    member = rng.integers(k, size=n)
    x = centres[member] + widths[member] * rng.normal(size=(n, d))
    if draw(st.booleans()):
        x = x[rng.integers(max(1, n // 4), size=n)]  # duplicates
    if draw(st.booleans()):
        x = x * 10.0 ** rng.uniform(-6, 6, size=d)  # a scale for each dimension
    if draw(st.booleans()):
        x[:, rng.integers(d)] = 3.0  # a constant column
    if draw(st.booleans()):
        x[0] *= 1e6  # an outlier
    return x


@pytest.mark.parametrize("covariance_type", ["full", "diag"])
@settings(max_examples=20, deadline=None, derandomize=True)
@given(points=point_sets(), seed=st.integers(0, 3))
def test_the_bound_never_falls(covariance_type, points, seed):
    mixture = DirichletProcessMixture(covariance_type, random_state=seed).fit(points)
    mixture.partial_fit(points)  # a warm start must not either
    bounds = np.array([lap.bound for lap in mixture.history_])
    assert np.all(np.isfinite(bounds))
    assert np.all(np.diff(bounds) >= -1e-8 * np.abs(bounds[1:]))
    assert mixture.lower_bound_ == bounds[-1]
    assert mixture.predict_proba(points).sum(1) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("covariance_type", ["full", "diag"])
@pytest.mark.parametrize("points", [np.zeros((1, 1)), np.full((1, 8), 1e6), np.zeros((40, 3)), np.full((40, 2), -1e-6)])
def test_one_place_is_one_component(covariance_type, points):
    mixture = DirichletProcessMixture(covariance_type).fit(points)
    assert mixture.n_components_ == 1
    assert mixture.means_[0] == pytest.approx(points[0])


def test_a_warm_start_gains_on_what_it_knew():
    """The first lap after a warm start is worth no less than the posterior that it began with."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(200, 2))
    points[100:, 0] += 6.0
    mixture = DirichletProcessMixture(random_state=0).fit(points)
    before = mixture.lower_bound_
    mixture.partial_fit(points)
    assert mixture.history_[0].bound >= before - 1e-8 * abs(before)
    assert mixture.lower_bound_ == pytest.approx(before, abs=0.01)
