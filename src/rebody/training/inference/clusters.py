"""Clusters of the beliefs during meta-training: fit, encoder update, fit, ... (thesis 5.3.2)."""

import jax
import numpy as np
from jaxtyping import Float, Int

from rebody.inference.mixture import DirichletProcessMixture
from rebody.inference.mixture.padded import Clusters, recall, remember
from rebody.training.inference.config import MetaConfig
from rebody.training.inference.episodes import Episodes
from rebody.types import Task


def refit(
    clusters: Clusters, replay: Episodes, stored: int, config: MetaConfig, rng: np.random.Generator
) -> tuple[Clusters, dict[str, float]]:
    """Fit the mixture to beliefs of stored episodes, from what it knew before; says how it went."""
    settings = config.mixture
    mixture = DirichletProcessMixture(
        covariance_type=settings.covariance_type,
        concentration=settings.concentration,
        prior_scale=settings.prior_scale,
        random_state=int(rng.integers(2**31)),
        n_components=settings.components,
    )
    latent, label = sample_beliefs(replay, stored, config, rng)
    mixture = recall(clusters, mixture).partial_fit(latent)
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


def sample_beliefs(
    replay: Episodes, stored: int, config: MetaConfig, rng: np.random.Generator
) -> tuple[Float[np.ndarray, "point latent"], Int[np.ndarray, " point"]]:
    """Means of beliefs, and their true base task: family x sign."""
    begin = config.mixture.from_decision
    shape = (stored, config.episodes, config.decisions + 1 - begin)
    size = min(config.mixture.points, int(np.prod(shape)))
    # none twice: points that coincide look like a cluster
    group, episode, time = np.unravel_index(rng.choice(np.prod(shape), size, replace=False), shape)
    time = time + begin
    latent = replay.belief.mean[group, episode, time]
    task = jax.tree.map(lambda leaf: np.asarray(leaf)[group, episode], replay.task)
    return np.asarray(latent, float), base_task(task)


def base_task(task: Task) -> Int[np.ndarray, "*batch"]:
    """The thesis counts front and back as two."""
    return 2 * np.asarray(task.family) + (np.asarray(task.target) > 0)


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
