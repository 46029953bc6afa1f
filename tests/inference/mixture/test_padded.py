"""The mixture as a prior in JAX: its values and gradients, and that padding is not there."""

import copy

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.inference.mixture import DirichletProcessMixture
from rebody.inference.mixture.padded import mixture_prior, no_clusters, no_mixture, recall, remember
from rebody.inference.prior import unit_gaussian
from rebody.types import Belief

D = 3


@pytest.fixture(autouse=True)
def double_precision():
    with jax.enable_x64(True):
        yield


@pytest.fixture(scope="module", params=["full", "diag"])
def mixture(request):
    """Three clusters in three dimensions."""
    rng = np.random.default_rng(0)
    shape = rng.normal(size=(3, D, D)) * 0.5
    x = [rng.normal(size=(n, D)) @ shape[i] + 3.0 * np.eye(3)[i] for i, n in enumerate((90, 60, 30))]
    return DirichletProcessMixture(request.param, n_components=3, random_state=0).fit(np.concatenate(x))


@pytest.fixture
def belief():
    """Some sure of a cluster, some between clusters, one far away."""
    rng = np.random.default_rng(1)
    mean = np.concatenate([3.0 * np.eye(3), rng.normal(1.0, 1.5, (6, D)), np.full((1, D), 20.0)])
    return Belief(mean, rng.uniform(0.01, 2.0, mean.shape))


def kl_sum(mixture, mean, variance, r):
    """sum_k r_k KL(N(mean, variance) || N(m_k, expected covariance)), written out in NumPy."""
    total = 0.0
    for n in range(len(mean)):
        for k in range(mixture.n_components_):
            covariance = mixture.covariances_[k]
            covariance = np.diag(covariance) if covariance.ndim == 1 else covariance
            inverse = np.linalg.inv(covariance)
            apart = mean[n] - mixture.means_[k]
            kl = np.trace(inverse @ np.diag(variance[n])) + apart @ inverse @ apart - D
            kl += np.log(np.linalg.det(covariance)) - np.sum(np.log(variance[n]))
            total += r[n, k] * 0.5 * kl
    return total


def differences(function, at, step=1e-5):
    """Gradient by central differences."""
    gradient = np.zeros_like(at)
    for i in np.ndindex(at.shape):
        moved = np.zeros_like(at)
        moved[i] = step * max(1.0, abs(at[i]))
        gradient[i] = (function(at + moved) - function(at - moved)) / (2 * moved[i])
    return gradient


def value_and_gradient(prior, belief):
    """Of the sum over beliefs."""

    @eqx.filter_jit
    def both(prior, belief):
        return jax.value_and_grad(lambda belief: prior(belief).sum())(belief)

    value, gradient = both(prior, jax.tree.map(jnp.asarray, belief))
    return float(value), np.asarray(gradient.mean), np.asarray(gradient.variance)


def test_values_and_gradients(mixture, belief):
    """Against the sum written out and its finite differences; no gradient goes through the responsibilities."""
    r = mixture.predict_proba(belief.mean)
    value, by_mean, by_variance = value_and_gradient(mixture_prior(mixture, 8), belief)
    assert value == pytest.approx(kl_sum(mixture, belief.mean, belief.variance, r), rel=1e-9)
    expected = differences(lambda mean: kl_sum(mixture, mean, belief.variance, r), belief.mean)
    np.testing.assert_allclose(by_mean, expected, rtol=1e-6, atol=1e-6)
    # the sum is curved strongly where variances are small
    expected = differences(lambda variance: kl_sum(mixture, belief.mean, variance, r), belief.variance, step=1e-6)
    np.testing.assert_allclose(by_variance, expected, rtol=1e-6, atol=1e-6)


def test_each_belief_has_its_own_value(mixture, belief):
    """Also with more than one batch axis."""
    prior = mixture_prior(mixture, 8)
    kl = eqx.filter_jit(prior)
    values = kl(belief)
    r = mixture.predict_proba(belief.mean)
    for n in range(len(r)):
        one = slice(n, n + 1)
        assert values[n] == pytest.approx(kl_sum(mixture, belief.mean[one], belief.variance[one], r[one]), rel=1e-9)
    folded = kl(jax.tree.map(lambda x: x.reshape(2, 5, D), belief))
    np.testing.assert_allclose(folded.reshape(-1), values, rtol=1e-12)


def test_responsibilities_are_those_of_the_mixture(mixture, belief):
    prior = mixture_prior(mixture, 8)
    r = prior.responsibilities(belief.mean)
    np.testing.assert_allclose(r[:, : mixture.n_components_], mixture.predict_proba(belief.mean), rtol=1e-9, atol=1e-12)
    assert np.all(np.asarray(r[:, mixture.n_components_ :]) == 0)


def test_padding_changes_nothing(mixture, belief):
    k = mixture.n_components_
    value, by_mean, by_variance = value_and_gradient(mixture_prior(mixture, k), belief)
    for maximum in (3, 8, 32):
        padded = mixture_prior(mixture, maximum)
        assert padded.active.sum() == k
        padded_value, *padded_gradients = value_and_gradient(padded, belief)
        assert padded_value == pytest.approx(value, rel=1e-14)
        np.testing.assert_allclose(padded_gradients, [by_mean, by_variance], rtol=1e-13, atol=1e-15)


def test_one_program_serves_every_number_of_components(mixture):
    """Nothing is traced again when the mixture grows."""
    shapes = [
        jax.tree.map(lambda leaf: (leaf.shape, leaf.dtype), prior)
        for prior in (no_mixture(8, D), mixture_prior(mixture, 8))
    ]
    assert jax.tree.leaves(shapes[0]) == jax.tree.leaves(shapes[1])


def test_too_many_components_leave_the_largest(mixture, belief):
    prior = mixture_prior(mixture, 2)
    np.testing.assert_allclose(prior.mean, mixture.means_[:2])
    r = mixture.predict_proba(belief.mean)[:-1, :2]  # far away shares of the first two may both vanish
    expected = r / r.sum(1, keepdims=True)
    np.testing.assert_allclose(prior.responsibilities(belief.mean)[:-1], expected, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("maximum", [1, 3, 32])
def test_nothing_fitted_is_a_unit_gaussian(belief, maximum):
    prior = no_mixture(maximum, D)
    np.testing.assert_array_equal(prior.responsibilities(belief.mean), 0.0)
    value, by_mean, by_variance = value_and_gradient(prior, belief)
    assert value == pytest.approx(float(unit_gaussian(jax.tree.map(jnp.asarray, belief)).sum()), rel=1e-12)
    np.testing.assert_allclose(by_mean, belief.mean, rtol=1e-12)
    np.testing.assert_allclose(by_variance, 0.5 * (1 - 1 / belief.variance), rtol=1e-12)


def test_gradients_stay_finite_far_away(mixture):
    """Where all shares but one vanish, in single precision as in training."""
    far = Belief(jnp.full((1, D), 1e4, jnp.float32), jnp.full((1, D), 1e-8, jnp.float32))
    fitted = mixture_prior(mixture, 8)
    prior = jax.tree.map(lambda leaf: leaf.astype(np.float32) if leaf.dtype == np.float64 else leaf, fitted)
    value, by_mean, by_variance = value_and_gradient(prior, far)
    assert np.isfinite(value)
    assert np.all(np.isfinite(by_mean))
    assert np.all(np.isfinite(by_variance))


def test_remembering_and_recalling(mixture):
    """A warm start from what a checkpoint holds is the warm start from the mixture itself."""
    rng = np.random.default_rng(2)
    x = rng.normal(size=(100, D)) * 0.5 + 3.0 * np.eye(3)[rng.integers(3, size=100)]
    fresh = DirichletProcessMixture(mixture.covariance_type, n_components=3, random_state=0)
    recalled = recall(remember(mixture, 8), fresh).partial_fit(x)
    went_on = copy.deepcopy(mixture).partial_fit(x)
    assert recalled.lower_bound_ == pytest.approx(went_on.lower_bound_, rel=1e-9)
    np.testing.assert_array_equal(recalled.component_ids_, went_on.component_ids_)


def test_recalled_mixtures_predict(mixture, belief):
    """Before another fit."""
    recalled = recall(remember(mixture, 8), DirichletProcessMixture(mixture.covariance_type))
    np.testing.assert_allclose(recalled.predict_proba(belief.mean), mixture.predict_proba(belief.mean), atol=1e-9)


def test_nothing_is_remembered_of_nothing():
    fresh = DirichletProcessMixture()
    assert recall(no_clusters(8, D), fresh) is fresh
    assert not no_clusters(8, D).prior.active.any()
