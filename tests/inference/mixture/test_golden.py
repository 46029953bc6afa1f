"""Two data sets whose bound is known from six runs of bnpy and an independent implementation."""

from pathlib import Path

import pytest
from safetensors.numpy import load_file
from sklearn.metrics import adjusted_rand_score

from rebody.inference.mixture import DirichletProcessMixture

DATA = Path(__file__).parent / "data"
KNOWN = [("corr", "full", -7065.530), ("axis", "diag", -7159.650)]


def fitted(case, covariance_type, seed):
    """A fit from one component, and its agreement with the truth."""
    data = load_file(DATA / f"case_{case}.safetensors")
    mixture = DirichletProcessMixture(covariance_type, random_state=seed).fit(data["X"])
    return mixture, adjusted_rand_score(data["y"], mixture.predict(data["X"]))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("case", "covariance_type", "bound"), KNOWN)
def test_it_finds_the_known_optimum(case, covariance_type, bound, seed):
    mixture, agreement = fitted(case, covariance_type, seed)
    assert mixture.n_components_ == 6
    assert mixture.lower_bound_ == pytest.approx(bound, abs=0.01)
    assert agreement == 1.0


@pytest.mark.usefixtures("as_users_call")
def test_splitting_correlated_clusters_for_a_diagonal_likelihood():
    """There is no one optimum, only a bound that it must not be worse than."""
    mixture, agreement = fitted("corr", "diag", seed=1)
    assert mixture.n_components_ >= 6
    assert mixture.lower_bound_ >= -7148.62
    assert agreement > 0.8
