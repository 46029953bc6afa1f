"""The Dirichlet process mixture that gives the latent space its clusters (thesis 2.6, 5.3.2)."""

from rebody.inference.mixture.estimator import DirichletProcessMixture

__all__ = ["DirichletProcessMixture"]
