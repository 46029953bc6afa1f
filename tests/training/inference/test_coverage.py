"""Coverage: of Gaussians that are honest, and of those that are too sure."""

from unittest.mock import Mock

import numpy as np
import pytest

from rebody.inference.reader import PlaceReader
from rebody.tasks import FamilySet
from rebody.tasks.line import GOAL
from rebody.training.inference.coverage import coverage
from rebody.types import Belief, Task

EPISODES = 4000


@pytest.mark.parametrize(("said", "shares"), [(1.0, (0.5, 0.9, 0.99)), (0.5, (0.264, 0.589, 0.802))])
def test_shares_are_those_of_a_gaussian(said, shares):
    rng = np.random.default_rng(0)
    mean = rng.uniform(-5.0, 5.0, (10, EPISODES, 1))
    tasks = Task(np.zeros((10, EPISODES), int), mean + rng.standard_normal(mean.shape))
    belief = Belief(mean, np.full(mean.shape, said**2))
    reader = Mock(spec=PlaceReader)  # reads a belief as the Gaussian that it is
    reader.spreads = lambda belief: [(belief.mean, belief.variance**0.5)]
    figures = coverage(reader, FamilySet((GOAL,)), tasks, belief)
    assert list(figures) == [f"goal in {region} % after 10" for region in (50, 90, 99)]
    np.testing.assert_allclose(np.array(list(figures.values())), shares, atol=0.025)
