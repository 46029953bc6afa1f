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


def test_unknown_family():
    with pytest.raises(RebodyError, match="Families are: goal"):
        TaskDistribution((BaseTask("fly", 0.0, 1.0),)).sample(jax.random.key(0), ())
