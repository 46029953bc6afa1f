"""The four verbs, each against its formula written out, and the bound against the definition of a bound."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats
from scipy.special import psi, xlogy

from rebody.inference.mixture.gaussians import KAPPA0, DiagonalGaussians, FullGaussians
from rebody.inference.mixture.model import Model, Responsibilities
from rebody.inference.mixture.statistics import combine, concatenate, stack

GAMMA, PRIOR_SCALE = 5.0, 0.1
N, D, K = 40, 3, 4
NU0 = D + 2
OFFSET = np.array([0.5, -1.0, 2.0])
KINDS = {"full": FullGaussians, "diag": DiagonalGaussians}


def uneven(rng, n, k):
    """Responsibilities with certain rows, empty entries and unlike sizes, in no order."""
    r = rng.dirichlet([0.3, 2.0, 0.1, 1.0][:k], size=n)
    r[0] = np.eye(k)[1]
    return r / r.sum(1, keepdims=True)


def soft(r):
    return Responsibilities(r, -xlogy(r, r).sum(0))


@pytest.fixture(params=["full", "diag"])
def case(request):
    """Points, responsibilities, their statistics, and the posterior that these give."""
    rng = np.random.default_rng(3)
    x = rng.normal(size=(N, D)) * [1.0, 3.0, 0.2] + OFFSET + rng.integers(0, 3, (N, 1))
    r = uneven(rng, N, K)
    model = Model(KINDS[request.param](PRIOR_SCALE, OFFSET), GAMMA)
    statistics = model.summarise(x, soft(r))
    return SimpleNamespace(
        diagonal=request.param == "diag",
        rng=rng,
        x=x,
        r=r,
        model=model,
        statistics=statistics,
        parameters=model.global_step(statistics),
        # B0, or beta0
        scale0=np.full(D, PRIOR_SCALE * (NU0 - 2)) if request.param == "diag" else PRIOR_SCALE * np.eye(D),
    )


def sticks(r):
    """eta1, eta0 and who comes before: the components by descending size."""
    count = r.sum(0)
    before = [[j for j in range(len(count)) if count[j] > count[k]] for k in range(len(count))]
    after = [sum(count[j] for j in range(len(count)) if count[j] < count[k]) for k in range(len(count))]
    return 1 + count, GAMMA + np.array(after), before


def test_summary_is_the_raw_moments(case):
    for k in range(K):
        count, first = 0.0, np.zeros(D)
        for n in range(N):
            count += case.r[n, k]
            first += case.r[n, k] * case.x[n]
        mean = first / count
        second = sum(case.r[n, k] * np.outer(case.x[n] - mean, case.x[n] - mean) for n in range(N))
        assert case.statistics.count[k] == pytest.approx(count)
        assert case.statistics.mean[k] == pytest.approx(mean)
        assert case.statistics.scatter[k] == pytest.approx(np.diag(second) if case.diagonal else second)
        assert case.statistics.entropy[k] == pytest.approx(-sum(p * np.log(p) for p in case.r[:, k] if p > 0))


def test_global_step(case):
    posterior = case.parameters.components
    eta1, eta0, before = sticks(case.r)
    for k in range(K):
        count = case.r[:, k].sum()
        first = case.r[:, k] @ case.x
        second = (case.r[:, k, None] * case.x).T @ case.x
        kappa = KAPPA0 + count
        mean = (KAPPA0 * OFFSET + first) / kappa
        spread = KAPPA0 * np.outer(OFFSET, OFFSET) + second - kappa * np.outer(mean, mean)
        assert posterior.nu[k] == pytest.approx(NU0 + count)
        assert posterior.kappa[k] == pytest.approx(kappa)
        assert posterior.mean[k] == pytest.approx(mean)
        assert posterior.scale[k] == pytest.approx(case.scale0 + (np.diag(spread) if case.diagonal else spread))
        log_weight = psi(eta1[k]) - psi(eta1[k] + eta0[k])
        log_weight += sum(psi(eta0[j]) - psi(eta1[j] + eta0[j]) for j in before[k])
        assert case.parameters.log_weight[k] == pytest.approx(log_weight)


def test_expected_covariances(case):
    posterior = case.parameters.components
    covariances = case.model.gaussians.covariances(posterior)
    for k in range(K):
        less = 2 if case.diagonal else D + 1
        assert covariances[k] == pytest.approx(posterior.scale[k] / (posterior.nu[k] - less))


def test_local_step(case):
    posterior = case.parameters.components
    log_rho = np.empty((N, K))
    for n in range(N):
        for k in range(K):
            nu, scale = posterior.nu[k], posterior.scale[k]
            apart = case.x[n] - posterior.mean[k]
            if case.diagonal:
                log_precision = sum(psi(nu / 2) + np.log(2) - np.log(scale[i]) for i in range(D))
                distance = sum(apart[i] ** 2 / scale[i] for i in range(D))
            else:
                log_precision = sum(psi((nu + 1 - i) / 2) for i in range(1, D + 1)) + D * np.log(2)
                log_precision -= np.log(np.linalg.det(scale))
                distance = apart @ np.linalg.inv(scale) @ apart
            log_rho[n, k] = case.parameters.log_weight[k] + 0.5 * log_precision - D / 2 * np.log(2 * np.pi)
            log_rho[n, k] -= 0.5 * (D / posterior.kappa[k] + nu * distance)
    expected = np.exp(log_rho) / np.exp(log_rho).sum(1, keepdims=True)
    result = case.model.local_step(case.x, case.parameters)
    assert result.r == pytest.approx(expected)
    assert result.r.sum(1) == pytest.approx(1.0)
    assert result.entropy == pytest.approx(-xlogy(expected, expected).sum(0))


def test_local_step_far_from_everything(case):
    """Where all but one share vanish, 0 ln 0 = 0."""
    result = case.model.local_step(np.full((1, D), 1e8), case.parameters)
    assert result.r.sum() == pytest.approx(1.0)
    assert np.all(np.isfinite(result.entropy))


def test_the_bound_is_its_definition(case):
    """E_q ln p(X, Z, v, mu, Lambda) - E_q ln q. After a global step, E_r ln p - ln q is the same at every v, mu and
    Lambda, so that any draw gives it: the densities are SciPy's."""
    posterior = case.parameters.components
    eta1, eta0, before = sticks(case.r)
    entropy = -xlogy(case.r, case.r).sum()
    for _ in range(5):
        v = case.rng.beta(eta1, eta0)
        log_ratio = np.sum(stats.beta.logpdf(v, 1.0, GAMMA) - stats.beta.logpdf(v, eta1, eta0))
        for k in range(K):
            log_pi = np.log(v[k]) + sum(np.log1p(-v[j]) for j in before[k])
            nu, scale = posterior.nu[k], posterior.scale[k]
            if case.diagonal:
                precisions = case.rng.gamma(nu / 2, 2 / scale)
                log_ratio += stats.gamma.logpdf(precisions, NU0 / 2, scale=2 / case.scale0).sum()
                log_ratio -= stats.gamma.logpdf(precisions, nu / 2, scale=2 / scale).sum()
                precision = np.diag(precisions)
            else:
                q = stats.wishart(nu, np.linalg.inv(scale))
                precision = q.rvs(random_state=case.rng)
                log_ratio += stats.wishart.logpdf(precision, NU0, np.linalg.inv(case.scale0)) - q.logpdf(precision)
            covariance = np.linalg.inv(precision)
            q = stats.multivariate_normal(posterior.mean[k], covariance / posterior.kappa[k])
            mu = q.rvs(random_state=case.rng)
            log_ratio += stats.multivariate_normal.logpdf(mu, OFFSET, covariance / KAPPA0) - q.logpdf(mu)
            log_likelihood = stats.multivariate_normal.logpdf(case.x, mu, covariance)
            log_ratio += case.r[:, k] @ (log_pi + log_likelihood)
        assert case.model.bound(case.statistics) == pytest.approx(log_ratio + entropy, rel=1e-9)


def test_the_bound_does_not_see_the_order_of_components_or_empty_ones(case):
    bound = case.model.bound(case.statistics)
    assert case.model.bound(case.statistics[[2, 0, 3, 1]]) == pytest.approx(bound, rel=1e-12)
    empty = case.model.summarise(case.x, soft(np.zeros((N, 1))))
    assert case.model.bound(concatenate([case.statistics, empty], 0)) == pytest.approx(bound, rel=1e-12)


def test_descending_size_is_the_best_order(case):
    """Every other order of the sticks is worth less."""
    count = np.array([3.0, 20.0, 7.0])

    def in_order(sizes):
        after = np.cumsum(sizes[::-1])[::-1] - sizes
        beta = stats.beta  # ln B(eta1, eta0) - ln B(1, gamma), from the densities' constants at v = 1/2
        eta1, eta0 = 1 + sizes, GAMMA + after
        half = np.log(0.5)
        log_b = (eta1 + eta0 - 2) * half - beta.logpdf(0.5, eta1, eta0)
        return np.sum(log_b - ((GAMMA - 1) * half - beta.logpdf(0.5, 1, GAMMA)))

    assert case.model.allocation(count) == pytest.approx(in_order(np.array([20.0, 7.0, 3.0])))
    for order in ([3.0, 20.0, 7.0], [7.0, 20.0, 3.0], [20.0, 3.0, 7.0], [3.0, 7.0, 20.0]):
        assert case.model.allocation(count) > in_order(np.array(order))


def test_combining_batches_adds_raw_moments(case):
    batches = [(case.x[i::3], case.r[i::3]) for i in range(3)]
    parts = stack([case.model.summarise(x, soft(r)) for x, r in batches])
    together = combine(parts)
    assert together.count == pytest.approx(sum(r.sum(0) for _, r in batches))
    assert together.entropy == pytest.approx(case.statistics.entropy)
    for k in range(K):
        first = sum(r[:, k] @ x for x, r in batches)
        second = sum((r[:, [k]] * x).T @ x for x, r in batches)
        scatter = second - np.outer(first, first) / together.count[k]
        assert together.mean[k] == pytest.approx(first / together.count[k])
        assert together.scatter[k] == pytest.approx(np.diag(scatter) if case.diagonal else scatter)


def test_combining_with_nothing_changes_nothing(case):
    nothing = case.model.summarise(case.x, soft(np.zeros((N, K))))
    together = combine(stack([nothing, case.statistics, nothing]))
    for result, expected in zip(vars(together).values(), vars(case.statistics).values(), strict=True):
        assert result == pytest.approx(expected, rel=1e-14)
    empty = combine(stack([nothing, nothing]))
    assert all(np.all(value == 0) for value in vars(empty).values())


def test_nothing_cancels_far_from_the_origin(case):
    """A cluster of width 1e-3 at 1e6: sums of squares would lose its scatter."""
    near = 1e-3 * case.rng.normal(size=(60, D))
    ones = soft(np.ones((20, 1)))
    at = near + 1e6
    exact = np.cov(at, rowvar=False, bias=True) * 60
    together = combine(stack([case.model.summarise(at[i::3], ones) for i in range(3)]))
    assert together.scatter[0] == pytest.approx(np.diag(exact) if case.diagonal else exact, rel=1e-5, abs=1e-9)
    assert together.scatter[0].max() == pytest.approx(6e-5, rel=0.5)
