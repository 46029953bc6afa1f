"""A probe: what can be read linearly from a belief. Fitted after training, never used by `reuse`."""

import warnings
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from rebody.inference.inputs import CIRCULAR
from rebody.tasks import Family, FamilySet
from rebody.types import AnyArray, Belief

RIDGE = 1e-6
NEVER = -1e9
"""Logit of a family that there was no sample of."""


class Probe(eqx.Module):
    """Logistic regression over families, ridge regression of each family's target; headings by sine and cosine."""

    family_weights: Float[AnyArray, "latent_and_one family"]
    target_weights: Float[AnyArray, "latent_and_one number"]
    families: FamilySet = eqx.field(static=True)

    def __call__(self, belief: Belief) -> tuple[Int[Array, "*batch"], Float[Array, "*batch axis"]]:
        """Family (its index in `families`) and target [m, m/s, rad] of each belief."""
        which = jnp.argmax(self._logits(belief), axis=-1)
        numbers = _with_one(jnp, belief.mean) @ self.target_weights
        of_each = [self.families.pad(_target(family, own)) for family, own in self._split(numbers)]
        targets = jnp.take_along_axis(jnp.stack(of_each, axis=-2), which[..., None, None], axis=-2)[..., 0, :]
        return which, targets

    def probabilities(self, belief: Belief) -> Float[Array, "*batch family"]:
        """Of each family."""
        return jax.nn.softmax(self._logits(belief), axis=-1)

    def spreads(self, belief: Belief) -> list[tuple[Float[AnyArray, "*batch _"], Float[AnyArray, "*batch _"]]]:
        """Of each family, were it the one: mean and standard deviation of its target, as sure as the belief is."""
        means = _with_one(jnp, belief.mean) @ self.target_weights
        deviations = jnp.sqrt(belief.variance @ self.target_weights[:-1] ** 2)
        own = zip(self._split(means), self._split(deviations), strict=True)
        return [(_target(family, mean), _without_headings(family, std)) for (family, mean), (_, std) in own]

    def _logits(self, belief: Belief) -> Float[Array, "*batch family"]:
        return _with_one(jnp, belief.mean) @ self.family_weights

    def _split(self, numbers: Float[AnyArray, "*batch number"]) -> list[tuple[Family, Float[AnyArray, "*batch _"]]]:
        ends = np.cumsum([_numbers(family) for family in self.families])[:-1]
        return list(zip(self.families, jnp.split(numbers, ends, axis=-1), strict=True))


def unfitted(families: FamilySet, latent: int) -> Probe:
    """One that knows nothing."""
    numbers = sum(map(_numbers, families))
    return Probe(jnp.zeros((latent + 1, len(families))), jnp.zeros((latent + 1, numbers)), families)


def fit_probe(
    families: FamilySet,
    latent: Float[np.ndarray, "sample latent"],
    family: Int[np.ndarray, " sample"],
    target: Float[np.ndarray, "sample axis"],
) -> Probe:
    """Fit on latents whose tasks are known; nothing is read of a family that there is no sample of."""
    # takes a second to import, which every command would wait for
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.linear_model import LogisticRegression, Ridge

    latent, numbers = latent.astype(float), []
    for i, each in enumerate(families):
        own = family == i
        weights = np.zeros((latent.shape[1] + 1, _numbers(each)))
        if own.any():
            ridge = Ridge(alpha=RIDGE * own.sum()).fit(latent[own], _as_numbers(each, target[own, : each.size]))
            weights = np.vstack([np.atleast_2d(ridge.coef_).T, ridge.intercept_])
        numbers.append(weights)
    weights = np.zeros((latent.shape[1] + 1, len(families)))
    if len(seen := np.unique(family)) > 1:
        logistic = LogisticRegression(C=1 / (2 * RIDGE * len(latent)), max_iter=1000)
        with warnings.catch_warnings():  # families that are told apart perfectly have no best weights
            warnings.simplefilter("ignore", ConvergenceWarning)
            logistic.fit(latent, family)
        both = np.vstack([logistic.coef_.T, logistic.intercept_])
        weights[-1] = np.where(np.isin(np.arange(len(families)), seen), 0.0, NEVER)
        weights[:, seen] = np.hstack([-both / 2, both / 2]) if len(seen) == 2 else both
    return Probe(weights.astype(np.float32), np.hstack(numbers).astype(np.float32), families)


def _with_one(xp, latent):
    return xp.concatenate([latent, xp.ones_like(latent[..., :1])], axis=-1)


def _numbers(family: Family) -> int:
    """Of a target, as it is read."""
    return family.size + sum(name in CIRCULAR for name in family.quantity.components)


def _as_numbers(family: Family, target: Any) -> Any:
    """Targets [sample, size] as they are read."""
    columns = []
    for i, name in enumerate(family.quantity.components):
        value = target[..., i]
        columns += [np.sin(value), np.cos(value)] if name in CIRCULAR else [value]
    return np.stack(columns, axis=-1)


def _target(family: Family, numbers: Any) -> Any:
    """The target that is read, [*batch, size]."""
    columns, i = [], 0
    for name in family.quantity.components:
        is_heading = name in CIRCULAR
        columns.append(jnp.arctan2(numbers[..., i], numbers[..., i + 1]) if is_heading else numbers[..., i])
        i += 1 + is_heading
    return jnp.stack(columns, axis=-1)


def _without_headings(family: Family, deviations: Any) -> Any:
    """One deviation of each component: of a heading that of its sine, which is that of a small turn."""
    firsts = np.cumsum([0, *(1 + (name in CIRCULAR) for name in family.quantity.components)])[:-1]
    return deviations[..., firsts]
