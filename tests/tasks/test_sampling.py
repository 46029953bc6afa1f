"""Base tasks come equally often, targets uniformly in their range."""

import jax
import numpy as np
import pytest

from rebody.errors import RebodyError
from rebody.tasks import GOAL, VELOCITY, BaseTask, TaskDistribution

TASKS = TaskDistribution((BaseTask("velocity", 1.0, 3.0), BaseTask("goal", -15.0, -2.0), BaseTask("goal", 2.0, 15.0)))


@pytest.fixture(scope="module")
def drawn():
    return TASKS.sample(jax.random.key(0), (4, 3000))


def test_shape_and_families(drawn):
    assert drawn.family.shape == drawn.target.shape == (4, 3000)
    assert TASKS.families == (GOAL, VELOCITY)
    assert TASKS.target_range("goal") == (-15.0, 15.0)


@pytest.mark.parametrize("base", TASKS.base_tasks)
def test_each_base_task_is_a_third_and_uniform_in_its_range(drawn, base):
    family = GOAL if base.family == "goal" else VELOCITY
    mine = (drawn.family == family) & (np.sign(drawn.target) == np.sign(base.low))
    targets = np.asarray(drawn.target)[np.asarray(mine)]
    assert len(targets) == pytest.approx(4000, abs=200)  # 4 standard deviations
    assert (targets >= base.low).all()
    assert (targets <= base.high).all()
    quartiles = np.quantile((targets - base.low) / (base.high - base.low), [0.25, 0.5, 0.75])
    np.testing.assert_allclose(quartiles, [0.25, 0.5, 0.75], atol=0.03)


EPISODES, DECISIONS = 2000, 12


@pytest.fixture(scope="module")
def switching():
    """Tasks [episode, decision] of which a quarter change."""
    return TASKS.sample_episodes(jax.random.key(1), EPISODES, DECISIONS, 0.25)


def changes(tasks):
    """Whether the task of a decision is another one than that before."""
    return np.diff(np.asarray(tasks.target), axis=1) != 0


def test_a_task_changes_once_at_most(switching):
    assert switching.family.shape == switching.target.shape == (EPISODES, DECISIONS)
    times = changes(switching).sum(axis=1)
    assert set(times) == {0, 1}
    assert times.mean() == pytest.approx(0.25, abs=0.04)  # 4 standard deviations
    assert (changes(switching) | (np.diff(switching.family, axis=1) == 0)).all()  # families with their targets


def test_a_task_changes_at_any_decision_but_the_first(switching):
    when = np.bincount(np.nonzero(changes(switching))[1], minlength=DECISIONS - 1)
    np.testing.assert_allclose(when / when.sum(), 1 / (DECISIONS - 1), atol=0.06)


def test_tasks_before_and_after_a_change_are_drawn_alike(switching):
    changed = changes(switching).any(axis=1)
    for decision in (0, -1):
        family, target = (np.asarray(part)[changed, decision] for part in (switching.family, switching.target))
        assert (family == VELOCITY).mean() == pytest.approx(1 / 3, abs=0.09)
        inside = np.where(family == VELOCITY, (target >= 1) & (target <= 3), (abs(target) >= 2) & (abs(target) <= 15))
        assert inside.all()
    first, last = np.asarray(switching.target)[changed][:, [0, -1]].T
    assert abs(np.corrcoef(first, last)[0, 1]) < 0.2


@pytest.mark.parametrize(("share", "changing"), [(0.0, 0), (1.0, 50)])
def test_no_task_changes_or_every_one(share, changing):
    assert changes(TASKS.sample_episodes(jax.random.key(0), 50, 8, share)).sum() == changing


def test_an_episode_of_one_decision_has_one_task():
    assert TASKS.sample_episodes(jax.random.key(0), 5, 1, 1.0).target.shape == (5, 1)


def test_unknown_family():
    with pytest.raises(RebodyError, match="Families are: goal"):
        TaskDistribution((BaseTask("fly", 0.0, 1.0),)).sample(jax.random.key(0), ())
