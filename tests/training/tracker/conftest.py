"""A few cheetahs and settings that fit them."""

import numpy as np
import pytest

from rebody.bodies import RobotBatch
from rebody.control.sac import SACConfig
from rebody.training.tracker import TrackerConfig

ROBOTS, STEPS, ROWS = 3, 4, 29  # a ring that is no multiple of the twelve rows of a turn


@pytest.fixture
def config():
    return TrackerConfig(
        robots=ROBOTS, steps=STEPS, updates=5, replay=ROWS, sac=SACConfig(hidden=(8, 8), batch_size=16)
    )


@pytest.fixture
def batch(cheetah):
    batch = RobotBatch(cheetah, ROBOTS)
    batch.reset(np.random.default_rng(0))
    return batch
