"""The fitted mixture as a prior of the encoder's loss: in JAX, its components padded to a static maximum."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jaxtyping import Bool, Float, Int

from rebody.inference.mixture.estimator import DirichletProcessMixture
from rebody.inference.mixture.fit import Known
from rebody.inference.mixture.gaussians import Posterior
from rebody.inference.mixture.model import Parameters
from rebody.inference.prior import unit_gaussian
from rebody.types import AnyArray, Belief


class MixturePrior(eqx.Module):
    """KL(q(z) || mixture) of thesis 5.6, weighted by responsibilities as it should be.

    Without components (nothing has been fitted yet) it is the KL to N(0, I).
    """

    active: Bool[AnyArray, " K"]
    log_weight: Float[AnyArray, " K"]  # E ln pi_k
    mean: Float[AnyArray, "K D"]
    root: Float[AnyArray, "K D D"]  # R with R^T R = B^-1
    nu: Float[AnyArray, " K"]
    kappa: Float[AnyArray, " K"]
    log_precision: Float[AnyArray, " K"]  # E ln |Lambda_k|
    spread: Float[AnyArray, " K"]  # the expected covariance is B / spread
    log_det: Float[AnyArray, " K"]  # of the expected covariance

    def responsibilities(self, z: Float[AnyArray, "*batch D"]) -> Float[AnyArray, "*batch K"]:
        """The local step: zero for padding."""
        log_rho = self.log_weight + 0.5 * (self.log_precision - self.nu * self._distance(z))
        log_rho = log_rho - 0.5 * z.shape[-1] * (jnp.log(2 * jnp.pi) + 1 / self.kappa)
        # a large number, not infinity: with padding only, nothing may become NaN
        return self.active * jax.nn.softmax(jnp.where(self.active, log_rho, -1e30), axis=-1)

    def shares(self, latent: Float[AnyArray, "*batch latent"]) -> Float[AnyArray, "*batch K"]:
        """Responsibilities for each latent, by the dimensions that are clustered: the first."""
        return self.responsibilities(latent[..., : self.mean.shape[-1]])

    def component(self, latent: Float[AnyArray, "*batch latent"]) -> Int[AnyArray, "*batch"]:
        """The likeliest component of each latent."""
        return jnp.argmax(self.shares(latent), axis=-1)

    def divergences(self, belief: Belief) -> Float[AnyArray, "*batch K"]:
        """KL to each component's expected Gaussian [nats]; zero for padding."""
        variance = belief.variance
        trace = jnp.einsum("...d,kd->...k", variance, jnp.sum(self.root**2, axis=-2))
        inside = self.spread * (trace + self._distance(belief.mean))
        log_ratio = self.log_det - jnp.sum(jnp.log(variance), axis=-1)[..., None]
        return jnp.where(self.active, 0.5 * (inside - variance.shape[-1] + log_ratio), 0.0)

    def __call__(self, belief: Belief) -> Float[AnyArray, "*batch"]:
        """sum_k r_k KL(q || component k) [nats]; no gradient goes through r."""
        r = jax.lax.stop_gradient(self.responsibilities(belief.mean))
        mixture = jnp.sum(r * self.divergences(belief), axis=-1)
        return jnp.where(self.active.any(), mixture, unit_gaussian(belief))

    def _distance(self, z: Float[AnyArray, "*batch D"]) -> Float[AnyArray, "*batch K"]:
        """(z - m)^T B^-1 (z - m)."""
        apart = z[..., None, :] - self.mean
        return jnp.sum(jnp.einsum("kij,...kj->...ki", self.root, apart) ** 2, axis=-1)


class Clusters(eqx.Module):
    """A mixture in arrays of fixed sizes: what a checkpoint holds, and what the next fit begins with."""

    prior: MixturePrior
    ids: Int[AnyArray, " K"]
    next_id: Int[AnyArray, ""]
    offset: Float[AnyArray, " D"]  # the prior mean


def no_clusters(maximum: int, dimensions: int) -> Clusters:
    """Nothing fitted yet."""
    prior = no_mixture(maximum, dimensions)
    return Clusters(prior, np.full(maximum, -1), np.zeros((), int), np.zeros(dimensions))


def clusters_of(prior: MixturePrior) -> Clusters:
    """Of a stored mixture: ids begin anew, and the prior mean is that of the components."""
    prior = jax.tree.map(np.asarray, prior)
    share = np.where(prior.active, prior.nu, 0.0)
    ids = np.where(prior.active, np.arange(len(share)), -1)
    return Clusters(prior, ids, np.array(prior.active.sum()), share @ prior.mean / max(share.sum(), 1.0))


def remember(mixture: DirichletProcessMixture, maximum: int) -> Clusters:
    """The largest components of a fitted mixture, at most `maximum`."""
    model, _ = mixture.fitted
    kept = _largest(mixture, maximum)
    ids = np.full(maximum, -1)
    ids[: len(kept)] = mixture.known.ids[kept]
    return Clusters(mixture_prior(mixture, maximum), ids, np.array(mixture.known.next_id), model.gaussians.offset)


def recall(clusters: Clusters, mixture: DirichletProcessMixture) -> DirichletProcessMixture:
    """The given mixture with what was remembered, if there is anything."""
    prior = jax.tree.map(np.asarray, clusters.prior)
    active = prior.active
    if not active.any():
        return mixture
    root = np.linalg.inv(prior.root[active])
    scale = root @ np.swapaxes(root, -1, -2)
    if mixture.covariance_type == "diag":
        root, scale = np.einsum("kii->ki", root), np.einsum("kii->ki", scale)
    posterior = Posterior(prior.nu[active], prior.kappa[active], prior.mean[active], scale, root)
    parameters = Parameters(prior.log_weight[active], posterior)
    return mixture.warm_start(
        Known(parameters, np.asarray(clusters.ids)[active], int(clusters.next_id)), np.asarray(clusters.offset)
    )


def no_mixture(maximum: int, dimensions: int) -> MixturePrior:
    """Padding only."""
    one = np.ones(maximum)
    return MixturePrior(
        active=np.zeros(maximum, bool),
        log_weight=np.zeros(maximum),
        mean=np.zeros((maximum, dimensions)),
        root=np.broadcast_to(np.eye(dimensions), (maximum, dimensions, dimensions)).copy(),
        nu=one * (dimensions + 2),
        kappa=one.copy(),
        log_precision=np.zeros(maximum),
        spread=one.copy(),
        log_det=np.zeros(maximum),
    )


def mixture_prior(mixture: DirichletProcessMixture, maximum: int) -> MixturePrior:
    """The largest components of a fitted mixture, at most `maximum`."""
    model, parameters = mixture.fitted
    gaussians, components = model.gaussians, parameters.components
    kept = _largest(mixture, maximum)
    covariances = gaussians.covariances(components)[kept]
    root, log_det = [], []
    for covariance, factor in zip(covariances, components.root[kept], strict=True):
        full = np.diag(factor) if factor.ndim == 1 else factor
        root.append(scipy.linalg.solve_triangular(full, np.eye(len(full)), lower=True))
        log_det.append(np.log(covariance).sum() if covariance.ndim == 1 else np.linalg.slogdet(covariance)[1])
    fitted = {
        "active": np.ones(len(kept), bool),
        "log_weight": parameters.log_weight[kept],
        "mean": components.mean[kept],
        "root": np.array(root),
        "nu": components.nu[kept],
        "kappa": components.kappa[kept],
        "log_precision": gaussians.log_precision(components)[kept],
        "spread": gaussians.spread(components)[kept],
        "log_det": np.array(log_det),
    }
    padded = no_mixture(maximum, gaussians.dimensions)
    for name, values in fitted.items():
        getattr(padded, name)[: len(kept)] = values
    return padded


def _largest(mixture: DirichletProcessMixture, maximum: int) -> Int[np.ndarray, " K"]:
    _, parameters = mixture.fitted
    return np.argsort(-parameters.components.nu, kind="stable")[:maximum]
