"""Gaussian components with their conjugate priors: Normal-Wishart, or Normal-Gamma for each dimension.

Numbers of formulas are those of Bishop (2006), chapter 10.2; the thesis' 5.11 is to be read as Normal-Wishart.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg
from jaxtyping import Float
from scipy.special import gammaln, psi

from rebody.inference.mixture.statistics import Array, Statistics

KAPPA0 = 1e-4
"""Weight of the prior mean, in points."""


@dataclass(frozen=True)
class Posterior:
    """Of every component's mean and precision."""

    nu: Float[np.ndarray, " K"]  # degrees of freedom
    kappa: Float[np.ndarray, " K"]  # weight of the mean
    mean: Float[np.ndarray, "K D"]
    scale: Array  # B [K, D, D] or beta [K, D]
    root: Array  # Cholesky factor of B, or square root of beta


class Gaussians(ABC):
    """One kind of covariance; `offset` is the prior mean."""

    def __init__(self, prior_scale: float, offset: Float[np.ndarray, " D"]):
        """`prior_scale`: variance that the prior expects in each dimension (sF)."""
        self.offset = offset
        self.dimensions = len(offset)
        self.nu0 = self.dimensions + 2.0
        self.prior_scale = prior_scale

    def posterior(self, statistics: Statistics) -> Posterior:
        """The global step for components: nu, kappa, m, B."""
        count = statistics.count
        kappa = KAPPA0 + count
        apart = statistics.mean - self.offset
        mean = self.offset + (count / kappa)[:, None] * apart
        scale = self._scale(statistics.scatter, KAPPA0 * count / kappa, apart)
        return Posterior(self.nu0 + count, kappa, mean, scale, self._root(scale))

    def evidence(self, statistics: Statistics) -> Float[np.ndarray, " K"]:
        """ln Z_k - ln Z_0 of each component: what its points are worth [nats], without N D/2 ln 2 pi."""
        posterior = self.posterior(statistics)
        return self._log_z(posterior) - self._log_z0

    def log_likelihood(self, x: Float[np.ndarray, "N D"], posterior: Posterior) -> Float[np.ndarray, "N K"]:
        """E ln N(x | mu_k, Lambda_k) under the posterior (Bishop 10.64, 10.65)."""
        result = np.empty((len(x), len(posterior.nu)))
        for k in range(result.shape[1]):
            apart = self.whiten(x, posterior, k)
            result[:, k] = np.einsum("nd,nd->n", apart, apart)
        result *= -0.5 * posterior.nu
        d = self.dimensions
        result += 0.5 * (self.log_precision(posterior) - d * np.log(2 * np.pi) - d / posterior.kappa)
        return result

    def covariances(self, posterior: Posterior) -> Array:
        """Expected covariances, [K, D, D] or [K, D]."""
        spread = self.spread(posterior)
        return posterior.scale / spread.reshape(-1, *[1] * (posterior.scale.ndim - 1))

    @abstractmethod
    def scatter(self, x: Float[np.ndarray, "N D"], weights: Float[np.ndarray, " N"], mean: Array) -> Array:
        """Scatter of one component's points about its mean."""

    @abstractmethod
    def log_precision(self, posterior: Posterior) -> Float[np.ndarray, " K"]:
        """E ln |Lambda_k|."""

    @abstractmethod
    def spread(self, posterior: Posterior) -> Float[np.ndarray, " K"]:
        """What B is divided by to give the expected covariance."""

    @abstractmethod
    def whiten(self, x: Float[np.ndarray, "N D"], posterior: Posterior, k: int) -> Float[np.ndarray, "N D"]:
        """Points in the units of component k."""

    @abstractmethod
    def _scale(self, scatter: Array, weight: Array, apart: Array) -> Array: ...

    @abstractmethod
    def _root(self, scale: Array) -> Array: ...

    @abstractmethod
    def _log_z(self, posterior: Posterior) -> Array: ...

    @cached_property
    def _log_z0(self) -> float:
        none = np.zeros(1)
        mean = np.zeros((1, self.dimensions))
        empty = self._scale(np.zeros_like(self._prior())[None], none, mean)
        return float(self._log_z(Posterior(none + self.nu0, none + KAPPA0, mean, empty, self._root(empty)))[0])

    @abstractmethod
    def _prior(self) -> Array: ...


class FullGaussians(Gaussians):
    """Normal-Wishart: B0 = sF I (nu0 - D - 1)."""

    def scatter(self, x, weights, mean):
        """[D, D]."""
        apart = x - mean
        return (apart * weights[:, None]).T @ apart

    def log_precision(self, posterior):
        """sum_i psi((nu + 1 - i) / 2) + D ln 2 - ln |B|."""
        d, nu = self.dimensions, posterior.nu
        log_det = 2 * np.log(np.einsum("kii->ki", posterior.root)).sum(-1)
        return psi(0.5 * (nu[:, None] - np.arange(d))).sum(-1) + d * np.log(2.0) - log_det

    def spread(self, posterior):
        """nu - D - 1."""
        return posterior.nu - self.dimensions - 1

    def whiten(self, x, posterior, k):
        """L^-1 (x - m)."""
        inverse = scipy.linalg.lapack.dtrtri(posterior.root[k], lower=1)[0]  # pyright: ignore[reportAttributeAccessIssue]
        return (x - posterior.mean[k]) @ inverse.T

    def _scale(self, scatter, weight, apart):
        return self._prior() + scatter + weight[:, None, None] * apart[:, :, None] * apart[:, None, :]

    def _root(self, scale):
        scale = 0.5 * (scale + np.swapaxes(scale, -1, -2))
        try:
            return np.linalg.cholesky(scale)
        except np.linalg.LinAlgError:
            return np.stack([_cholesky(one) for one in scale])

    def _log_z(self, posterior):
        d, nu = self.dimensions, posterior.nu
        log_det = 2 * np.log(np.einsum("kii->ki", posterior.root)).sum(-1)
        # the multivariate gamma function but for its constant, which ln Z_0 has too
        log_gamma = gammaln(0.5 * (nu[:, None] - np.arange(d))).sum(-1)
        return 0.5 * nu * d * np.log(2.0) + log_gamma - 0.5 * nu * log_det - 0.5 * d * np.log(posterior.kappa)

    def _prior(self):
        return self.prior_scale * (self.nu0 - self.dimensions - 1) * np.eye(self.dimensions)


class DiagonalGaussians(Gaussians):
    """Normal-Gamma for each dimension: beta0 = sF (nu0 - 2)."""

    def scatter(self, x, weights, mean):
        """[D]."""
        return weights @ (x - mean) ** 2

    def log_precision(self, posterior):
        """sum_d psi(nu / 2) + ln 2 - ln beta_d."""
        return self.dimensions * (psi(0.5 * posterior.nu) + np.log(2.0)) - np.log(posterior.scale).sum(-1)

    def spread(self, posterior):
        """nu - 2."""
        return posterior.nu - 2

    def whiten(self, x, posterior, k):
        """(x - m) / sqrt(beta)."""
        return (x - posterior.mean[k]) / posterior.root[k]

    def _scale(self, scatter, weight, apart):
        return self._prior() + scatter + weight[:, None] * apart**2

    def _root(self, scale):
        return np.sqrt(scale)

    def _log_z(self, posterior):
        nu = posterior.nu[:, None]
        per_dimension = (
            0.5 * nu * np.log(2.0)
            + gammaln(0.5 * nu)
            - 0.5 * nu * np.log(posterior.scale)
            - 0.5 * np.log(posterior.kappa)[:, None]
        )
        return per_dimension.sum(-1)

    def _prior(self):
        return np.full(self.dimensions, self.prior_scale * (self.nu0 - 2))


def _cholesky(matrix: Float[np.ndarray, "D D"]) -> Float[np.ndarray, "D D"]:
    """Of a matrix whose smallest eigenvalues may have drowned in the rounding of the largest: as little as needed
    is added to its diagonal."""
    diagonal, share = np.diag(np.diag(matrix)), 0.0
    while True:
        try:
            return np.linalg.cholesky(matrix + share * diagonal)
        except np.linalg.LinAlgError:
            share = max(10.0 * share, 1e-15)
