"""Base tasks come equally often, targets uniformly in their range."""

import jax
import numpy as np
import pytest
from tests.tasks.conftest import PLACE

from rebody.ranges import Box, interval
from rebody.tasks import FamilySet
from rebody.tasks.family_set import draw, sample, sample_episodes
from rebody.tasks.line import GOAL, VELOCITY
from rebody.tasks.plane import PLANE, ring

FAMILIES = FamilySet((GOAL.within(interval(-15.0, -2.0), interval(2.0, 15.0)), VELOCITY.within(interval(1.0, 3.0))))
OF_GOAL, OF_VELOCITY = 0, 1
BASE_TASKS = [(i, box) for i, family in enumerate(FAMILIES) for box in family.targets]
WIDE = FamilySet((PLACE.within(Box((1.0, -4.0), (3.0, -2.0)), Box((-9.0, 0.0), (9.0, 1.0))), GOAL))


@pytest.fixture(scope="module")
def drawn():
    return sample(FAMILIES, jax.random.key(0), (4, 3000))


def test_shape_and_families(drawn):
    assert drawn.family.shape == (4, 3000)
    assert drawn.target.shape == (4, 3000, 1)
    assert set(np.unique(drawn.family)) == {OF_GOAL, OF_VELOCITY}


def assert_a_share_and_uniform(family, target, which, box, count):
    """Each number between its ends, and zeros behind."""
    size = box.size
    inside = np.all((target[:, :size] >= box.low) & (target[:, :size] <= box.high), axis=-1)
    mine = target[(family == which) & inside]
    assert len(mine) == pytest.approx(count, abs=200)  # 4 standard deviations
    assert not mine[:, size:].any()
    share = (mine[:, :size] - box.low) / np.subtract(box.high, box.low)
    quartiles = np.quantile(share, [0.25, 0.5, 0.75], axis=0)
    np.testing.assert_allclose(quartiles, np.tile([[0.25], [0.5], [0.75]], size), atol=0.03)


@pytest.mark.parametrize(("which", "box"), BASE_TASKS)
def test_each_base_task_is_a_third_and_uniform_in_its_range(drawn, which, box):
    family, target = np.asarray(drawn.family).ravel(), np.asarray(drawn.target).reshape(-1, 1)
    assert_a_share_and_uniform(family, target, which, box, 4000)


@pytest.mark.parametrize("of_numpy", [False, True])
def test_vectors_are_uniform_in_their_boxes(of_numpy):
    if of_numpy:
        rng = np.random.default_rng(0)
        tasks = [draw(WIDE, rng) for _ in range(12_000)]
        family, target = (np.stack(part) for part in zip(*((t.family, t.target) for t in tasks), strict=True))
    else:
        drawn = sample(WIDE, jax.random.key(1), (12_000,))
        family, target = np.asarray(drawn.family), np.asarray(drawn.target)
    assert target.shape == (12_000, 2)
    boxes = [(i, box) for i, each in enumerate(WIDE) for box in each.targets]
    for which, box in boxes:
        assert_a_share_and_uniform(family, target, which, box, 3000)
    of_one = target[(family == 0) & (target[:, 1] < 0)]
    assert abs(np.corrcoef(of_one.T)[0, 1]) < 0.08  # one number says nothing of the other


def test_one_task_from_numpy_is_a_task():
    task = draw(WIDE, np.random.default_rng(3))
    assert (task.family.shape, task.target.shape) == ((), (2,))
    again = draw(WIDE, np.random.default_rng(3))
    np.testing.assert_array_equal(task.target, again.target)


EPISODES, DECISIONS = 2000, 12


@pytest.fixture(scope="module")
def switching():
    """Tasks [episode, decision] of which a quarter change."""
    return sample_episodes(FAMILIES, jax.random.key(1), EPISODES, DECISIONS, 0.25)


def changes(tasks):
    """Whether the task of a decision is another one than that before."""
    return (np.diff(np.asarray(tasks.target), axis=1) != 0).any(axis=-1)


def test_a_task_changes_once_at_most(switching):
    assert switching.family.shape == (EPISODES, DECISIONS)
    assert switching.target.shape == (EPISODES, DECISIONS, 1)
    times = changes(switching).sum(axis=1)
    assert set(times) == {0, 1}
    assert times.mean() == pytest.approx(0.25, abs=0.04)  # 4 standard deviations
    assert (changes(switching) | (np.diff(switching.family, axis=1) == 0)).all()  # families with their targets


def test_all_numbers_of_a_target_change_at_once():
    both = np.diff(np.asarray(sample_episodes(WIDE, jax.random.key(2), 200, 8, 1.0).target), axis=1) != 0
    assert (both.any(axis=-1).sum(axis=1) == 1).all()
    assert both.all(axis=-1).sum() > 50  # from one place to another


def test_a_task_changes_at_any_decision_but_the_first(switching):
    when = np.bincount(np.nonzero(changes(switching))[1], minlength=DECISIONS - 1)
    np.testing.assert_allclose(when / when.sum(), 1 / (DECISIONS - 1), atol=0.06)


def test_tasks_before_and_after_a_change_are_drawn_alike(switching):
    changed = changes(switching).any(axis=1)
    targets = np.asarray(switching.target)[..., 0]
    for decision in (0, -1):
        family, target = np.asarray(switching.family)[changed, decision], targets[changed, decision]
        is_speed = family == OF_VELOCITY
        assert is_speed.mean() == pytest.approx(1 / 3, abs=0.09)
        assert np.where(is_speed, (target >= 1) & (target <= 3), (abs(target) >= 2) & (abs(target) <= 15)).all()
    first, last = targets[changed][:, [0, -1]].T
    assert abs(np.corrcoef(first, last)[0, 1]) < 0.2


@pytest.mark.parametrize(("share", "changing"), [(0.0, 0), (1.0, 50)])
def test_no_task_changes_or_every_one(share, changing):
    assert changes(sample_episodes(FAMILIES, jax.random.key(0), 50, 8, share)).sum() == changing


def test_an_episode_of_one_decision_has_one_task():
    assert sample_episodes(FAMILIES, jax.random.key(0), 5, 1, 1.0).target.shape == (5, 1, 1)


@pytest.mark.parametrize("of_numpy", [False, True])
def test_in_a_ring_length_and_bearing_are_uniform(of_numpy):
    sector = FamilySet((PLANE.named("place").within(Box((2.0, 0.5), (6.0, 2.0), polar=True)), GOAL))
    for families, low, high in (
        (PLANE.only(("place",)), (2.0, -np.pi), (15.0, np.pi)),
        (sector, (2.0, 0.5), (6.0, 2.0)),
    ):
        if of_numpy:
            rng = np.random.default_rng(0)
            tasks = [draw(families, rng) for _ in range(6000)]
            family, target = (np.stack(part) for part in zip(*((t.family, t.target) for t in tasks), strict=True))
        else:
            drawn = sample(families, jax.random.key(2), (6000,))
            family, target = np.asarray(drawn.family), np.asarray(drawn.target)
        x, y = target[family == 0].T
        polar = np.stack([np.hypot(x, y), np.arctan2(y, x)], axis=-1)
        share = (polar - low) / np.subtract(high, low)
        assert share.min() > -1e-5
        assert share.max() < 1 + 1e-5
        quartiles = np.quantile(share, [0.25, 0.5, 0.75], axis=0)
        np.testing.assert_allclose(quartiles, np.tile([[0.25], [0.5], [0.75]], 2), atol=0.04)


def test_what_is_around_a_ring():
    assert ring(2.0, 15.0).around == Box((-15.0, -15.0), (15.0, 15.0))
    assert ring(2.0, 15.0).largest == (15.0, 15.0)
    assert PLANE.named("place").range == Box((-15.0, -15.0), (15.0, 15.0))
    assert Box((1.0,), (2.0,)).around == Box((1.0,), (2.0,))


@pytest.mark.parametrize(
    ("low", "high"), [((1.0,), (2.0,)), ((-1.0, 0.0), (2.0, 1.0)), ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))]
)
def test_a_polar_box_is_of_a_plane(low, high):
    with pytest.raises(ValueError, match="a polar one has two numbers, a length that is not negative and a bearing"):
        Box(low, high, polar=True)
