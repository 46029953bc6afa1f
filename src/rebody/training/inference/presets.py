"""Presets: functions that return settings; the command line has the last word."""

from collections.abc import Callable
from dataclasses import replace

from rebody.bodies.toys import Randomisation
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


def position_thesis() -> MetaConfig:
    """The thesis' first experiment (6.3.1): positions in [0, 10] m, steps of at most 0.1 m, a latent of one number.

    Nothing is randomised but where episodes start.
    """
    base = position()
    return replace(
        base,
        toy="position",
        tasks=TaskDistribution((BaseTask("goal", 0.0, 10.0),)),
        inference=replace(base.inference, latent=1),
        policy_fields=("x",),
        policy_scales=(10.0,),
        randomisation=Randomisation(ripple_amplitude=0.0, lag=0.0, gain=(1.0, 1.0)),
        start=(12.0, 0.0),
        turn_probability=0.02,
    )


def goal_velocity() -> MetaConfig:
    """Reach a hidden position or run at a hidden speed, front or back (thesis 6.4.2), told apart without labels."""
    return MetaConfig(
        tasks=TaskDistribution(
            (
                BaseTask("goal", 2.0, 15.0),
                BaseTask("goal", -15.0, -2.0),
                BaseTask("velocity", 1.0, 3.0),
                BaseTask("velocity", -3.0, -1.0),
            )
        ),
        reward="relative",
        inference=InferenceConfig(fields=("x", "vx"), scales=(10.0, 3.0), reward_scale=1.0, latent=6, units=96),
        sac=SACConfig(
            hidden=(256, 256),
            projections=16,
            discount=0.95,
            learning_rate=5e-4,
            decay_updates=150_000,
            huber=0.05,
        ),
        prior="mixture",
        arrival=0.05,
        policy_fields=("x", "vx"),
        policy_scales=(10.0, 3.0),
        start=(15.0, 3.0),
        episodes=96,
        wander_iterations=40,
        joint_iterations=80,
        policy_iterations=100,
        policy_updates=768,
    )


PRESETS: dict[str, Callable[[], MetaConfig]] = {
    "position": position,
    "position-thesis": position_thesis,
    "goal-velocity": goal_velocity,
}
