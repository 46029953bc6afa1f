"""Clusters of the beliefs during meta-training: fit, encoder update, fit, ... (thesis 5.3.2)."""

import jax
import numpy as np
from jaxtyping import Float, Int

from rebody.inference.mixture import DirichletProcessMixture
from rebody.inference.mixture.padded import Clusters, recall, remember
from rebody.training.inference.config import MetaConfig, MixtureConfig
from rebody.training.inference.episodes import Episodes
from rebody.types import Belief


def refit(
    clusters: Clusters, episodes: Episodes, config: MetaConfig, rng: np.random.Generator
) -> tuple[Clusters, dict[str, float]]:
    """Fit the mixture to beliefs held in episodes, from what it knew before; says how it went."""
    settings = config.mixture
    latent, label = sample_beliefs(episodes, config, rng)
    mixture = recall(clusters, new_mixture(settings, rng)).partial_fit(latent)
    laps = mixture.history_
    figures = {
        "components": mixture.n_components_,
        "elbo": mixture.lower_bound_ / len(latent),
        "births": sum(lap.births for lap in laps),
        "merges": sum(lap.merges for lap in laps),
        "deletes": sum(lap.deletes for lap in laps),
        **agreement(mixture.predict(latent), label),
    }
    return remember(mixture, settings.maximum), {f"mixture/{name}": float(value) for name, value in figures.items()}


def new_mixture(settings: MixtureConfig, rng: np.random.Generator) -> DirichletProcessMixture:
    """A mixture that knows nothing."""
    return DirichletProcessMixture(
        covariance_type=settings.covariance_type,
        concentration=settings.concentration,
        prior_scale=settings.prior_scale,
        random_state=int(rng.integers(2**31)),
        n_components=settings.components,
    )


def sample_beliefs(
    episodes: Episodes, config: MetaConfig, rng: np.random.Generator
) -> tuple[Float[np.ndarray, "point clustered"], Int[np.ndarray, " point"]]:
    """Latents drawn from beliefs, in the dimensions that the mixture clusters, and their true base task.

    Drawn, since the prior is for draws: means alone are a thinner cloud than the loss sees, and fall into strands.
    """
    begin = config.mixture.from_decision
    shape = (config.episodes, config.decisions + 1 - begin)
    size = min(config.mixture.points, int(np.prod(shape)))
    # none twice: points that coincide look like a cluster
    episode, time = np.unravel_index(rng.choice(np.prod(shape), size, replace=False), shape)
    time = time + begin
    latent = draw(jax.tree.map(lambda leaf: np.asarray(leaf)[episode, time], episodes.belief), config, rng)
    task = jax.tree.map(lambda leaf: np.asarray(leaf)[episode, time - 1], episodes.task)
    return latent, np.asarray(config.families.base_task(task))


def draw(belief: Belief, config: MetaConfig, rng: np.random.Generator) -> Float[np.ndarray, "point clustered"]:
    """A latent of each belief, in the dimensions that the mixture clusters."""
    mean, variance = (
        np.asarray(part[:, : config.inference.clustered], float) for part in (belief.mean, belief.variance)
    )
    return mean + np.sqrt(variance) * rng.standard_normal(mean.shape)


def agreement(cluster: Int[np.ndarray, " point"], label: Int[np.ndarray, " point"]) -> dict[str, float]:
    """Purity, adjusted Rand index and normalised mutual information of clusters and labels."""
    # takes a second to import, which every command would wait for
    from sklearn.metrics import adjusted_rand_score, normalized_mutual_info_score
    from sklearn.metrics.cluster import contingency_matrix

    return {
        "purity": contingency_matrix(label, cluster).max(axis=0).sum() / len(label),
        "ari": adjusted_rand_score(label, cluster),
        "nmi": normalized_mutual_info_score(label, cluster),
    }
