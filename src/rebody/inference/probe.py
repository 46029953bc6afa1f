"""A probe: what can be read linearly from a belief. Fitted after training, never used by `reuse`."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.optimize
import scipy.special
from jaxtyping import Array, Float, Int

from rebody.types import AnyArray, Belief

RIDGE = 1e-6


class Probe(eqx.Module):
    """Logistic regression over families, ridge regression of the target per family."""

    families: Int[AnyArray, " family"]  # index of each family in `rebody.tasks.FAMILIES`
    family_weights: Float[AnyArray, "latent_and_one family"]
    target_weights: Float[AnyArray, "latent_and_one family"]

    def __call__(self, belief: Belief) -> tuple[Int[Array, "*batch"], Float[Array, "*batch"]]:
        """Family (its index in `rebody.tasks.FAMILIES`) and target [m, m/s, rad] of each belief."""
        which = jnp.argmax(self._logits(belief), axis=-1)
        of_each = _with_one(jnp, belief.mean) @ self.target_weights
        targets = jnp.take_along_axis(of_each, which[..., None], axis=-1)[..., 0]
        return jnp.asarray(self.families)[which], targets

    def probabilities(self, belief: Belief) -> Float[Array, "*batch family"]:
        """Of each family, in the order of `families`."""
        return jax.nn.softmax(self._logits(belief), axis=-1)

    def chances_of_front(self, belief: Belief) -> Float[Array, "*batch family"]:
        """Of each family, were it the one: how likely its target is positive, as sure as the belief is."""
        mean = _with_one(jnp, belief.mean) @ self.target_weights
        variance = belief.variance @ self.target_weights[:-1] ** 2
        return jax.scipy.stats.norm.cdf(mean / jnp.sqrt(variance))

    def _logits(self, belief: Belief) -> Float[Array, "*batch family"]:
        return _with_one(jnp, belief.mean) @ self.family_weights


def fit_probe(
    latent: Float[np.ndarray, "sample latent"],
    family: Int[np.ndarray, " sample"],
    target: Float[np.ndarray, " sample"],
) -> Probe:
    """Fit on latents whose tasks are known."""
    features = _with_one(np, latent.astype(np.float64))
    families, which = np.unique(family, return_inverse=True)
    targets = np.stack([_ridge(features[which == i], target[which == i]) for i in range(len(families))], axis=-1)
    return Probe(
        families.astype(np.int32),
        _logistic(features, which, len(families)).astype(np.float32),
        targets.astype(np.float32),
    )


def _with_one(xp, latent):
    return xp.concatenate([latent, xp.ones_like(latent[..., :1])], axis=-1)


def _ridge(features: Float[np.ndarray, "sample n"], target: Float[np.ndarray, " sample"]):
    gram = features.T @ features + RIDGE * len(features) * np.eye(features.shape[1])
    return np.linalg.solve(gram, features.T @ target)


def _logistic(features: Float[np.ndarray, "sample n"], which: Int[np.ndarray, " sample"], families: int):
    """Multinomial logistic regression with a small ridge, by L-BFGS."""
    shape = (features.shape[1], families)
    chosen = np.eye(families)[which]

    def loss(flat):
        weights = flat.reshape(shape)
        logits = features @ weights
        log_likelihood = np.sum(logits * chosen, axis=-1) - scipy.special.logsumexp(logits, axis=-1)
        slope = features.T @ (scipy.special.softmax(logits, axis=-1) - chosen) / len(features)
        return RIDGE * np.sum(flat**2) - log_likelihood.mean(), (slope + 2 * RIDGE * weights).ravel()

    return scipy.optimize.minimize(loss, np.zeros(np.prod(shape)), jac=True, method="L-BFGS-B").x.reshape(shape)
