"""The mixture as users see it: streams, what it refuses, and what it promises."""

import copy

import numpy as np
import pytest

from rebody.errors import RebodyError
from rebody.inference.mixture import DirichletProcessMixture

pytestmark = pytest.mark.usefixtures("as_users_call")

CENTRES = {"a": [0.0, 0.0], "b": [8.0, 0.0], "c": [0.0, 8.0], "d": [8.0, 8.0], "e": [-8.0, 0.0]}


def around(names, rng, n=70):
    """Points of width 0.5 about these centres."""
    return np.concatenate([rng.normal(0.0, 0.5, (n, 2)) + CENTRES[name] for name in names])


def ids_at(mixture, names):
    """Lasting id of the component at each centre."""
    found = mixture.component_ids_[mixture.predict(np.array([CENTRES[name] for name in names]))]
    return dict(zip(names, found.tolist(), strict=True))


@pytest.fixture(scope="module")
def three_once():
    rng = np.random.default_rng(0)
    x = rng.permutation(np.concatenate([around("a", rng, 200), around("b", rng, 120), around("c", rng, 30)]))
    return x, DirichletProcessMixture(random_state=0).fit(x)


@pytest.fixture
def three(three_once):
    """Three clusters of unlike sizes, and a fit to them."""
    return copy.deepcopy(three_once)


# streams


@pytest.mark.parametrize(("covariance_type", "seed"), [("full", 0), ("diag", 1)])
def test_a_stream(covariance_type, seed):
    """Clusters that appear are born within 2 fits, vanished ones are gone within 3, the others stay who they are."""
    rng = np.random.default_rng(seed)
    mixture = DirichletProcessMixture(covariance_type, random_state=seed)
    known = {}
    for names, fits in (("ab", 2), ("abc", 2), ("bc", 3), ("bcde", 2), ("ade", 3)):
        for _ in range(fits):
            mixture.partial_fit(around(names, rng))
        ids = ids_at(mixture, names)
        assert mixture.n_components_ == len(names)
        assert sorted(mixture.component_ids_.tolist()) == sorted(ids.values())
        assert len(set(ids.values())) == len(names)
        stayed = [name for name in names if name in known]
        assert [ids[name] for name in stayed] == [known[name] for name in stayed]
        known = ids


def test_ids_are_not_used_again():
    rng = np.random.default_rng(0)
    mixture = DirichletProcessMixture(random_state=0).fit(around("ab", rng))
    first = ids_at(mixture, "ab")
    for _ in range(3):
        mixture.partial_fit(around("a", rng))
    for _ in range(2):
        mixture.partial_fit(around("ab", rng))
    again = ids_at(mixture, "ab")
    assert again["a"] == first["a"]
    assert again["b"] not in first.values()


def test_the_first_partial_fit_is_a_fit():
    x = around("ab", np.random.default_rng(0))
    partial = DirichletProcessMixture(random_state=3).partial_fit(x)
    assert partial.lower_bound_ == DirichletProcessMixture(random_state=3).fit(x).lower_bound_


def test_a_fit_forgets_earlier_ones(three):
    x, mixture = three
    bound = mixture.lower_bound_
    mixture.partial_fit(x + 100.0)
    mixture.fit(x)
    assert mixture.lower_bound_ == bound


def test_a_large_set_is_fitted_to_all_its_points():
    """Also where the first fit is to a sample."""
    rng = np.random.default_rng(0)
    x = around("abc", rng, 7000)
    mixture = DirichletProcessMixture("diag", random_state=0).fit(x)
    assert mixture.n_components_ == 3
    assert mixture.weights_ == pytest.approx(1 / 3, abs=0.01)
    assert len(mixture.history_) < 20


# what is promised


@pytest.mark.parametrize("covariance_type", ["full", "diag"])
def test_attributes(three, covariance_type):
    x, _ = three
    mixture = DirichletProcessMixture(covariance_type, random_state=1).fit(x)
    assert mixture.n_components_ == 3
    assert mixture.weights_ == pytest.approx([200 / 350, 120 / 350, 30 / 350], abs=0.03)
    assert mixture.weights_.sum() == pytest.approx(1.0)
    assert np.all(np.diff(mixture.weights_) < 0)
    assert mixture.means_ == pytest.approx(np.array([CENTRES[name] for name in "abc"]), abs=0.3)
    expected = np.array([0.25 * np.eye(2)] * 3) if covariance_type == "full" else np.full((3, 2), 0.25)
    assert mixture.covariances_ == pytest.approx(expected, abs=0.1)
    assert mixture.component_ids_.shape == (3,)
    assert mixture.lower_bound_ == mixture.history_[-1].bound
    assert mixture.history_[-1].components == 3


def test_probabilities_are_in_the_order_of_the_weights(three):
    x, mixture = three
    probabilities = mixture.predict_proba(x)
    assert probabilities.shape == (350, 3)
    assert probabilities.sum(1) == pytest.approx(1.0)
    assert probabilities.sum(0) == pytest.approx([200, 120, 30], abs=0.5)
    nearest = np.argmin(((x[:, None] - mixture.means_) ** 2).sum(-1), axis=1)
    np.testing.assert_array_equal(mixture.predict(x), nearest)


def test_predicting_far_away_stays_finite(three):
    _, mixture = three
    probabilities = mixture.predict_proba(np.array([[1e12, -1e12], [0.0, 0.0]]))
    assert np.all(np.isfinite(probabilities))
    assert probabilities.sum(1) == pytest.approx(1.0)


def test_same_seed_same_result(three):
    x, mixture = three
    again = DirichletProcessMixture(random_state=0).fit(x)
    assert again.lower_bound_ == mixture.lower_bound_
    np.testing.assert_array_equal(again.means_, mixture.means_)
    np.testing.assert_array_equal(again.component_ids_, mixture.component_ids_)
    np.testing.assert_array_equal(again.predict_proba(x), mixture.predict_proba(x))
    for refit in (again, mixture):
        refit.partial_fit(x[:200])
    np.testing.assert_array_equal(again.means_, mixture.means_)


def test_another_seed_same_optimum(three):
    x, mixture = three
    other = DirichletProcessMixture(random_state=7).fit(x)
    assert other.lower_bound_ == pytest.approx(mixture.lower_bound_, abs=1e-3)


def test_shifting_all_points_changes_nothing(three):
    """The prior mean goes with them."""
    x, mixture = three
    far = np.array([1e5, -1e5])
    shifted = DirichletProcessMixture(random_state=0).fit(x + far)
    assert shifted.lower_bound_ == pytest.approx(mixture.lower_bound_, abs=1e-2)
    assert shifted.means_ - far == pytest.approx(mixture.means_, abs=1e-4)


def test_the_points_are_left_alone(three):
    x, mixture = three
    before = x.copy()
    mixture.partial_fit(x)
    mixture.predict(x)
    np.testing.assert_array_equal(x, before)


@pytest.mark.parametrize("k", [1, 2, 5])
def test_a_fixed_number_of_components(three, k):
    x, mixture = three
    fixed = DirichletProcessMixture(n_components=k, random_state=0).fit(x)
    assert fixed.n_components_ == k
    assert fixed.weights_.shape == (k,)
    assert fixed.lower_bound_ <= mixture.lower_bound_ + 1e-6
    assert fixed.partial_fit(x).n_components_ == k
    assert not any(lap.births or lap.merges or lap.deletes for lap in fixed.history_)


def test_the_right_number_fixed_finds_the_optimum(three):
    x, mixture = three
    fixed = DirichletProcessMixture(n_components=3, random_state=0).fit(x)
    assert fixed.lower_bound_ == pytest.approx(mixture.lower_bound_, abs=1e-3)


# what is refused


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_points_that_are_not_finite_are_refused(three, bad):
    x, mixture = three
    x = x.copy()
    x[[3, 5], [0, 1]] = bad
    for refuses in (DirichletProcessMixture().fit, mixture.partial_fit, mixture.predict, mixture.predict_proba):
        with pytest.raises(RebodyError, match="2 of 350 points hold NaN or infinite"):
            refuses(x)


@pytest.mark.parametrize("shape", [(5,), (2, 3, 4), (0, 2), (4, 0), ()])
def test_other_shapes_are_refused(shape):
    with pytest.raises(RebodyError, match=r"shape \[N, D\]"):
        DirichletProcessMixture().fit(np.zeros(shape))


def test_points_of_another_dimension_are_refused(three):
    _, mixture = three
    for refuses in (mixture.partial_fit, mixture.predict, mixture.predict_proba):
        with pytest.raises(RebodyError, match="2 dimensions, these have 3"):
            refuses(np.zeros((4, 3)))


def test_predicting_before_a_fit_is_refused():
    for refuses in (DirichletProcessMixture().predict, DirichletProcessMixture().predict_proba):
        with pytest.raises(RebodyError, match="fit"):
            refuses(np.zeros((4, 3)))


def test_what_is_like_points_is_taken():
    """Lists, whole numbers, single precision."""
    rows = [[0, 1], [2, 3], [4, 4]]
    bounds = [DirichletProcessMixture().fit(x).lower_bound_ for x in (rows, np.array(rows), np.array(rows, "float32"))]
    assert bounds[0] == bounds[1] == bounds[2]


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"covariance_type": "tied"}, "'tied'"),
        ({"concentration": 0.0}, "concentration"),
        ({"concentration": np.nan}, "concentration"),
        ({"prior_scale": -1.0}, "prior_scale"),
        ({"prior_scale": np.inf}, "prior_scale"),
        ({"n_batches": 0}, "n_batches"),
        ({"n_batches": 2.5}, "n_batches"),
        ({"n_components": 0}, "n_components"),
        ({"n_components": -3}, "n_components"),
    ],
)
def test_settings_that_make_no_sense_are_refused(settings, says):
    with pytest.raises(RebodyError, match=says):
        DirichletProcessMixture(**settings)
