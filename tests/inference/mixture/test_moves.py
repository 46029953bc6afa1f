"""Moves: taken only for a gain, exact in what they leave behind, and components keep their ids."""

import numpy as np
import pytest
from scipy.special import xlogy

from rebody.inference.mixture.fit import begin, begin_from
from rebody.inference.mixture.gaussians import DiagonalGaussians, FullGaussians
from rebody.inference.mixture.model import Model, Responsibilities
from rebody.inference.mixture.moves import birth, delete, merge


@pytest.fixture(params=[FullGaussians, DiagonalGaussians])
def model(request):
    return Model(request.param(0.1, np.zeros(2)), 5.0)


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def blobs(rng, *centres_and_sizes):
    """Points of width 0.5 about each centre, and whose they are."""
    x = [rng.normal(0.0, 0.5, (n, 2)) + centre for centre, n in centres_and_sizes]
    return np.concatenate(x), np.repeat(np.arange(len(x)), [len(part) for part in x])


def started(model, x, part, rng, batches=3):
    """A fit with the components that `part` says, after one lap so that shares are soft."""
    rows = np.array_split(rng.permutation(len(x)), batches)
    fit = begin(model, [x[these] for these in rows], [part[these] for these in rows])
    return lap(fit)


def lap(fit):
    for b in range(len(fit.batches)):
        fit.visit(b)
    return fit


def assert_exact(fit):
    """What the fit says of itself is what its responsibilities say."""
    x, r = np.concatenate(fit.batches), np.concatenate([shares.r for shares in fit.responsibilities])
    assert r.shape == (len(x), fit.k)
    assert r.sum(1) == pytest.approx(1.0, abs=1e-12)
    assert np.all(r >= 0)
    anew = fit.model.summarise(x, Responsibilities(r, -xlogy(r, r).sum(0)))
    assert fit.bound == pytest.approx(fit.model.bound(anew), rel=1e-10)
    assert fit.total.count == pytest.approx(anew.count, abs=1e-9)
    assert fit.total.entropy == pytest.approx(anew.entropy, abs=1e-8)
    for shares in fit.responsibilities:
        assert shares.entropy == pytest.approx(-xlogy(shares.r, shares.r).sum(0), abs=1e-9)
    assert fit.parameters.components.nu == pytest.approx(fit.model.global_step(anew).components.nu)
    assert fit.parameters.log_weight == pytest.approx(fit.model.global_step(anew).log_weight)
    assert len(set(fit.ids.tolist())) == fit.k
    assert fit.next_id > fit.ids.max()


def settle(fit):
    """Laps and merges: a birth may begin with more parts than stay."""
    for _ in range(20):
        while merge(fit):
            assert_exact(fit)
        lap(fit)
    return fit


def snapshot(fit):
    return fit.bound, fit.ids.tolist(), [shares.r.copy() for shares in fit.responsibilities]


def assert_unchanged(fit, before):
    bound, ids, shares = before
    assert fit.bound == bound
    assert fit.ids.tolist() == ids
    for now, then in zip(fit.responsibilities, shares, strict=True):
        np.testing.assert_array_equal(now.r, then)


# merge


def test_two_halves_of_one_blob_become_one(model, rng):
    x, _ = blobs(rng, ([1.0, 2.0], 200))
    fit = started(model, x, rng.integers(0, 2, 200), rng)
    before, larger = fit.bound, int(fit.ids[np.argmax(fit.total.count)])
    assert merge(fit) == 1
    assert fit.ids.tolist() == [larger]
    assert fit.bound > before
    assert_exact(fit)
    assert fit.bound == pytest.approx(started(model, x, np.zeros(200, int), rng).bound, rel=1e-10)


def test_each_component_is_merged_once_at_most(model, rng):
    x, _ = blobs(rng, ([0.0, 0.0], 300))
    fit = started(model, x, rng.integers(0, 5, 300), rng)
    bounds = [fit.bound]
    assert merge(fit) == 2  # five components: two pairs
    bounds.append(fit.bound)
    assert_exact(fit)
    while merge(fit):
        bounds.append(fit.bound)
        assert_exact(fit)
    assert fit.k == 1
    assert np.all(np.diff(bounds) > 0)


def test_the_right_pair_is_merged(model, rng):
    x, part = blobs(rng, ([0.0, 0.0], 150), ([8.0, 0.0], 100), ([0.0, 8.0], 120))
    part[part == 1] = rng.choice([1, 3], 100, p=[0.7, 0.3])
    fit = started(model, x, part, rng)
    assert merge(fit) == 1
    assert sorted(fit.ids.tolist()) == [0, 1, 2]
    assert_exact(fit)


def test_who_was_there_before_survives_a_merge(model, rng):
    """Even if it is the smaller one."""
    x, _ = blobs(rng, ([0.0, 0.0], 200))
    fit = started(model, x, (np.arange(200) < 40).astype(int), rng, batches=1)
    smaller = int(fit.ids[np.argmin(fit.total.count)])
    fit.homes = {smaller: np.zeros(2)}
    assert merge(fit) == 1
    assert fit.ids.tolist() == [smaller]


def test_blobs_apart_are_not_merged(model, rng):
    x, part = blobs(rng, ([0.0, 0.0], 100), ([8.0, 0.0], 100))
    fit = started(model, x, part, rng)
    before = snapshot(fit)
    assert merge(fit) == 0
    assert_unchanged(fit, before)


# birth


def test_two_blobs_are_split(model, rng):
    x, part = blobs(rng, ([0.0, 0.0], 150), ([8.0, 0.0], 60))
    fit = started(model, x, np.zeros(len(x), int), rng)
    before = fit.bound
    assert birth(fit, 0, rng)
    assert fit.k >= 2
    assert fit.bound > before
    assert_exact(fit)
    assert fit.ids[np.argmax(fit.total.count)] == 0  # the largest part is who the component was
    born = fit.bound
    settle(fit)
    assert fit.bound >= born
    assert np.sort(fit.total.count) == pytest.approx([60, 150], abs=0.01)
    assert fit.bound == pytest.approx(settle(started(model, x, part, rng)).bound, abs=1e-4)


def test_only_the_target_is_split(model, rng):
    """The shares of the others stay to the last bit, and their ids."""
    x, part = blobs(rng, ([0.0, 0.0], 120), ([8.0, 0.0], 80), ([0.0, 8.0], 90))
    fit = started(model, x, np.minimum(part, 1), rng)
    target = int(np.flatnonzero(fit.ids == 1)[0])
    other = [shares.r[:, 1 - target].copy() for shares in fit.responsibilities]
    assert birth(fit, target, rng)
    assert_exact(fit)
    assert {0, 1} < set(fit.ids.tolist())
    for shares, kept in zip(fit.responsibilities, other, strict=True):
        np.testing.assert_array_equal(shares.r[:, np.flatnonzero(fit.ids == 0)[0]], kept)
    assert settle(fit).k == 3


def test_the_part_at_home_keeps_the_id(model, rng):
    """After a warm start the part nearest to where the component lay is who it was, though it be the smaller."""
    at_home, _ = blobs(rng, ([0.0, 0.0], 100))
    known = started(model, at_home, np.zeros(100, int), rng).known
    x, _ = blobs(rng, ([0.0, 0.0], 50), ([8.0, 0.0], 200))
    fit = begin_from(model, [x[::2], x[1::2]], known)
    assert birth(fit, 0, rng)
    assert_exact(fit)
    settle(fit)
    assert fit.k == 2
    home = int(np.argmin((fit.parameters.components.mean**2).sum(1)))
    assert fit.ids[home] == 0
    assert fit.total.count[home] == pytest.approx(50, abs=0.01)


def test_one_blob_is_not_split(model, rng):
    x, part = blobs(rng, ([3.0, 0.0], 200))
    fit = started(model, x, part, rng)
    before = snapshot(fit)
    for _ in range(2):
        assert not birth(fit, 0, rng)
    assert_unchanged(fit, before)
    assert fit.next_id == 1


@pytest.mark.parametrize("points", [np.zeros((1, 2)), np.zeros((30, 2))])
def test_there_is_nothing_to_split_in_one_place(model, rng, points):
    fit = begin(model, [points], [np.zeros(len(points), int)])
    assert not birth(fit, 0, rng)
    assert_exact(fit)


# delete


def test_a_component_without_points_of_its_own_is_deleted(model, rng):
    """It has some points of each of two blobs."""
    x, part = blobs(rng, ([0.0, 0.0], 150), ([8.0, 0.0], 150))
    part[rng.choice(300, 30, replace=False)] = 2
    fit = begin(model, [x[::2], x[1::2]], [part[::2], part[1::2]])
    before = fit.bound
    assert delete(fit, 2)
    assert fit.ids.tolist() == [0, 1]
    assert fit.bound > before
    assert_exact(fit)


def test_a_component_with_its_own_points_is_not_deleted(model, rng):
    x, part = blobs(rng, ([0.0, 0.0], 150), ([8.0, 0.0], 20))
    fit = started(model, x, part, rng)
    before = snapshot(fit)
    assert not delete(fit, int(np.argmin(fit.total.count)))
    assert_unchanged(fit, before)


def test_the_last_component_stays(model, rng):
    x, part = blobs(rng, ([0.0, 0.0], 20))
    assert not delete(started(model, x, part, rng), 0)


# laps


def test_visiting_batches_keeps_the_books(model, rng):
    x, part = blobs(rng, ([0.0, 0.0], 100), ([2.0, 0.0], 100), ([0.0, 1.5], 60))
    fit = started(model, x, part, rng, batches=4)
    bounds = []
    for _ in range(5):
        for b in range(4):
            fit.visit(b)
            bounds.append(fit.bound)
        assert_exact(fit)
    assert np.all(np.diff(bounds) >= -1e-9 * abs(bounds[-1]))


def test_an_empty_component_goes(model, rng):
    """Left over from a warm start: no points near it."""
    x, part = blobs(rng, ([0.0, 0.0], 100), ([50.0, 50.0], 100))
    known = started(model, x, part, rng).known
    fit = begin_from(model, [x[part == 0]], known)
    empty = int(np.argmin(fit.total.count))
    assert fit.total.count[empty] == pytest.approx(0.0, abs=1e-9)
    assert np.isfinite(fit.bound)
    assert delete(fit, empty) or merge(fit)
    assert fit.k == 1
    assert fit.ids.tolist() == [0]
    assert_exact(fit)
