"""Presets: functions that return settings; the command line has the last word."""

from collections.abc import Callable

from rebody.control.sac import SACConfig
from rebody.inference import InferenceConfig
from rebody.tasks import BaseTask, TaskDistribution
from rebody.training.inference.config import MetaConfig


def position() -> MetaConfig:
    """Reach a hidden position within +-10 m on the mass-damper, reward -|error| (thesis 6.3.1).

    The encoder sees x and the reward alone: velocity would add nothing but a robot's gait.
    """
    return MetaConfig(
        tasks=TaskDistribution((BaseTask("goal", 0.0, 10.0), BaseTask("goal", -10.0, 0.0))),
        reward="plain",
        inference=InferenceConfig(fields=("x",), scales=(10.0,), reward_scale=10.0, latent=2),
        sac=SACConfig(
            hidden=(128, 128),
            projections=8,
            discount=0.95,
            learning_rate=5e-4,
            decay_updates=65_000,
            huber=0.05,
        ),
        arrival=0.05,
        policy_fields=("x", "vx"),
        policy_scales=(10.0, 3.5),
    )


PRESETS: dict[str, Callable[[], MetaConfig]] = {"position": position}
