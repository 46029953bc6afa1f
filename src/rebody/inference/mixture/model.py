"""The mixture's four verbs: local step, summary, global step, bound (Hughes & Sudderth 2013; thesis 2.6).

Components may stand in any order: each formula of the stick-breaking prior takes them by descending size, the
order that maximises the bound.
"""

from dataclasses import dataclass

import numpy as np
import scipy.special
from jaxtyping import Float
from scipy.special import gammaln, psi

from rebody.inference.mixture.gaussians import Gaussians, Posterior
from rebody.inference.mixture.statistics import Statistics


@dataclass(frozen=True)
class Parameters:
    """What the global step knows: q(v) as expected log-weights, q(mu, Lambda)."""

    log_weight: Float[np.ndarray, " K"]  # E ln v_k + sum_{j before k} E ln(1 - v_j)
    components: Posterior


@dataclass(frozen=True)
class Responsibilities:
    """Of one batch, and what they lose in entropy."""

    r: Float[np.ndarray, "N K"]
    entropy: Float[np.ndarray, " K"]  # -sum_n r ln r


class Model:
    """A Dirichlet process mixture's prior: concentration and components."""

    def __init__(self, gaussians: Gaussians, concentration: float):
        self.gaussians = gaussians
        self.concentration = concentration

    def local_step(self, x: Float[np.ndarray, "N D"], parameters: Parameters) -> Responsibilities:
        """r = softmax(ln rho), a row per point."""
        log_rho = self.gaussians.log_likelihood(x, parameters.components)
        log_rho += parameters.log_weight
        log_r = log_rho - scipy.special.logsumexp(log_rho, axis=1, keepdims=True)
        r = np.exp(log_r)
        # 0 ln 0 = 0, where the logarithm may be minus infinity
        entropy = -np.einsum("nk,nk->k", r, np.where(r > 0, log_r, 0.0))
        return Responsibilities(r, entropy)

    def summarise(self, x: Float[np.ndarray, "N D"], responsibilities: Responsibilities) -> Statistics:
        """Statistics of one batch."""
        r = responsibilities.r
        count = r.sum(0)
        mean = np.divide(r.T @ x, count[:, None], out=np.zeros((r.shape[1], x.shape[1])), where=count[:, None] > 0)
        scatter = np.stack([self.gaussians.scatter(x, r[:, k], mean[k]) for k in range(r.shape[1])])
        return Statistics(count, mean, scatter, responsibilities.entropy)

    def global_step(self, statistics: Statistics) -> Parameters:
        """The posterior that these statistics give; eta1 = 1 + N_k, eta0 = gamma + N of all smaller ones."""
        order = np.argsort(-statistics.count, kind="stable")
        count = statistics.count[order]
        eta1, eta0 = 1.0 + count, self.concentration + _after(count)
        both = psi(eta1 + eta0)
        log_v, log_rest = psi(eta1) - both, psi(eta0) - both
        log_weight = np.empty_like(count)
        log_weight[order] = log_v + np.concatenate([[0.0], np.cumsum(log_rest)[:-1]])
        return Parameters(log_weight, self.gaussians.posterior(statistics))

    def bound(self, statistics: Statistics) -> float:
        """The ELBO [nats], exact after a global step on these statistics."""
        n = statistics.count.sum()
        constant = 0.5 * n * self.gaussians.dimensions * np.log(2 * np.pi)
        evidence = self.gaussians.evidence(statistics).sum()
        return float(self.allocation(statistics.count) + evidence - constant + statistics.entropy.sum())

    def allocation(self, count: Float[np.ndarray, " K"]) -> float:
        """L_alloc: what the stick-breaking prior says of these sizes [nats]."""
        count, gamma = -np.sort(-count), self.concentration
        at_least = _after(count) + count
        per_component = np.log(gamma) + gammaln(1.0 + count) - np.log(gamma + at_least)
        return float(gammaln(gamma) - gammaln(gamma + count.sum()) + per_component.sum())


def _after(count: Float[np.ndarray, " K"]) -> Float[np.ndarray, " K"]:
    """N_{>k}: how many points the later components have."""
    return np.concatenate([np.cumsum(count[::-1])[::-1][1:], [0.0]])
