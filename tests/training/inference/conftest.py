"""A tiny meta-training."""

import jax
import pytest

from rebody.bodies.toys import MassDamper
from rebody.control.sac import SACConfig
from rebody.inference import InferenceConfig
from rebody.tasks import FamilySet
from rebody.tasks.line import GOAL, both_ways
from rebody.training.inference import MetaConfig
from rebody.training.inference.train import initial_state


@pytest.fixture(scope="session")
def config():
    return MetaConfig(
        families=FamilySet((GOAL.within(*both_ways(0.0, 10.0), law="plain"),)),
        inference=InferenceConfig(window=4, units=8, batch_size=300, decoded=3, reward_scale=10.0),
        sac=SACConfig(hidden=(8, 8), batch_size=300),
        policy_fields=("x", "vx"),
        policy_scales=(10.0, 3.5),
        episodes=8,
        decisions=12,
        groups=3,
    )


@pytest.fixture(scope="session")
def state(config):
    """A run that has not begun."""
    return initial_state(config, MassDamper(), jax.random.key(0))
