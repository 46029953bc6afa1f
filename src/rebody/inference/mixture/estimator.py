"""The mixture as users see it: scikit-learn's face."""

from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from rebody.errors import RebodyError
from rebody.inference.mixture.fit import Fit, Known, begin, begin_from
from rebody.inference.mixture.gaussians import DiagonalGaussians, FullGaussians
from rebody.inference.mixture.laps import Lap, run
from rebody.inference.mixture.model import Model, Parameters
from rebody.inference.mixture.moves import spread

COARSE = 10_000
"""Points of the first, coarse fit to a large set."""


class DirichletProcessMixture:
    """A mixture of Gaussians that finds the number of its components (thesis 2.6, 5.3.2).

    Attributes after fitting (components by descending size): `n_components_`, `weights_` [K], `means_` [K, D],
    `covariances_` [K, D, D] or [K, D], `component_ids_` [K] (a component keeps its id over refits),
    `lower_bound_` (the ELBO in nats), `history_` (a `Lap` for each lap of the last fit).
    """

    def __init__(
        self,
        covariance_type: Literal["full", "diag"] = "full",
        concentration: float = 5.0,
        prior_scale: float = 0.1,
        n_batches: int = 5,
        random_state: int = 0,
        n_components: int | None = None,
    ):
        """`concentration`: gamma of v_k ~ Beta(1, gamma); `prior_scale`: variance that the prior expects (sF).

        `n_components` fixes the number of components, for comparison; by default it is found.
        """
        if covariance_type not in ("full", "diag"):
            raise RebodyError(f"covariance_type must be 'full' or 'diag', not {covariance_type!r}.")
        for name, value in (("concentration", concentration), ("prior_scale", prior_scale), ("n_batches", n_batches)):
            if not (np.isfinite(value) and value > 0):
                raise RebodyError(f"{name} must be positive, not {value}.")
        for name, value in (("n_batches", n_batches), ("n_components", n_components)):
            if value is not None and (value != int(value) or value < 1):
                raise RebodyError(f"{name} must be a whole number of at least 1, not {value}.")
        self.covariance_type = covariance_type
        self.concentration = concentration
        self.prior_scale = prior_scale
        self.n_batches = n_batches
        self.random_state = random_state
        self.n_components = n_components
        self._model: Model | None = None

    def fit(self, X: Float[np.ndarray, "N D"], y: None = None) -> "DirichletProcessMixture":
        """Fit from one component on; RebodyError for points that are not finite or not [N, D]."""
        X = _checked(X, None)
        self._model = self._prior(X.mean(0))
        rng = np.random.default_rng(self.random_state)
        if len(X) <= 2 * COARSE:
            return self._finish(*self._run(self._begin(X, rng), rng))
        # most of the way on a sample: what it finds, all the points only have to refine
        coarse, _ = self._run(self._begin(rng.permutation(X)[:COARSE], rng), rng)
        return self._finish(*self._run(begin_from(self._model, self._shuffled(X, rng), coarse.known), rng))

    def partial_fit(self, X: Float[np.ndarray, "N D"], y: None = None) -> "DirichletProcessMixture":
        """Fit to other points of the same kind, beginning with what is known; components keep their ids.

        The points of earlier fits are forgotten: where the encoder has changed, they are void.
        """
        if self._model is None:
            return self.fit(X)
        X = _checked(X, self._model.gaussians.dimensions)
        rng = np.random.default_rng((self.random_state, self.known.next_id, len(X)))
        return self._finish(*self._run(begin_from(self._model, self._shuffled(X, rng), self.known), rng))

    def warm_start(self, known: Known, offset: Float[np.ndarray, " D"]) -> "DirichletProcessMixture":
        """Take over what an earlier mixture knew (`known`, and its prior mean); `partial_fit` goes on from there."""
        self._model, self.known = self._prior(offset), known
        self._order = np.argsort(-known.parameters.components.nu, kind="stable")
        return self

    def predict_proba(self, X: Float[np.ndarray, "N D"]) -> Float[np.ndarray, "N K"]:
        """Responsibilities of the components for each point."""
        model, parameters = self.fitted
        X = _checked(X, model.gaussians.dimensions)
        return model.local_step(X, parameters).r[:, self._order]

    def predict(self, X: Float[np.ndarray, "N D"]) -> Int[np.ndarray, " N"]:
        """Index of the most responsible component of each point; `component_ids_` has its lasting id."""
        return np.argmax(self.predict_proba(X), axis=1)

    def _prior(self, offset: Float[np.ndarray, " D"]) -> Model:
        kind = FullGaussians if self.covariance_type == "full" else DiagonalGaussians
        return Model(kind(self.prior_scale, offset), self.concentration)

    def _begin(self, X: Float[np.ndarray, "N D"], rng: np.random.Generator) -> Fit:
        """One component, or as many as are wanted, around points far from one another."""
        assert self._model is not None
        batches = self._shuffled(X, rng)
        together = np.concatenate(batches)
        parts = spread(together, np.ones(len(X)), rng, self.n_components or 1)
        return begin(self._model, batches, np.split(parts, np.cumsum([len(batch) for batch in batches])[:-1]))

    def _run(self, start: Fit, rng: np.random.Generator) -> tuple[Fit, list[Lap]]:
        return run(start, rng, moves=self.n_components is None)

    def _shuffled(self, X: Float[np.ndarray, "N D"], rng: np.random.Generator) -> list[Float[np.ndarray, "_ D"]]:
        batches = np.array_split(rng.permutation(X), min(self.n_batches, len(X)))
        return [np.ascontiguousarray(batch) for batch in batches]

    def _finish(self, fit: Fit, history: list[Lap]) -> "DirichletProcessMixture":
        order = np.argsort(-fit.total.count, kind="stable")
        components, model = fit.parameters.components, fit.model
        self.known, self._order, self.history_ = fit.known, order, history
        self.n_components_ = fit.k
        self.weights_ = np.exp(fit.parameters.log_weight[order])
        self.weights_ /= self.weights_.sum()
        self.means_ = components.mean[order]
        self.covariances_ = model.gaussians.covariances(components)[order]
        self.component_ids_ = fit.ids[order]
        self.lower_bound_ = fit.bound
        return self

    @property
    def fitted(self) -> tuple[Model, Parameters]:
        """Prior and posterior; RebodyError before the first fit."""
        if self._model is None:
            raise RebodyError("this mixture has not been fitted yet; call fit first.")
        return self._model, self.known.parameters


def _checked(X: Float[np.ndarray, "N D"], dimensions: int | None) -> Float[np.ndarray, "N D"]:
    X = np.asarray(X, np.float64)
    if X.ndim != 2 or 0 in X.shape:
        raise RebodyError(f"expected points of shape [N, D] with N and D at least 1, got {X.shape}.")
    if dimensions is not None and X.shape[1] != dimensions:
        raise RebodyError(f"the mixture was fitted to points of {dimensions} dimensions, these have {X.shape[1]}.")
    if faulty := np.count_nonzero(~np.isfinite(X).all(axis=1)):
        raise RebodyError(f"{faulty} of {len(X)} points hold NaN or infinite values; remove them before fitting.")
    return X
