"""A few cheetahs and settings that fit them."""

import numpy as np
import pytest

from rebody.bodies import RobotBatch
from rebody.control.command import commands_within
from rebody.control.sac import SACConfig
from rebody.ranges import interval
from rebody.tasks import SHIPPED
from rebody.training.tracker import TrackerConfig

COMMANDS = commands_within((("goal", interval(-5.0, 5.0)), ("velocity", interval(-3.0, 3.0))), SHIPPED)
ROBOTS, STEPS, ROWS = 3, 4, 29  # a buffer that is no multiple of the twelve rows of a turn


@pytest.fixture
def config():
    return TrackerConfig(
        families=COMMANDS,
        robots=ROBOTS,
        steps=STEPS,
        updates=5,
        replay=ROWS,
        push=0.0,
        sac=SACConfig(hidden=(8, 8), batch_size=16),
    )


@pytest.fixture
def batch(cheetah):
    batch = RobotBatch(cheetah, ROBOTS)
    batch.reset(np.random.default_rng(0))
    return batch
