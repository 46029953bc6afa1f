"""Presets: functions that return settings; the command line has the last word."""

from collections.abc import Callable
from dataclasses import replace

from rebody.bodies.disturbance import CALM
from rebody.control.high_level import high_level_sac
from rebody.inference import InferenceConfig
from rebody.ranges import interval
from rebody.tasks import FamilySet
from rebody.tasks.line import GOAL, JUMP, STAND, VELOCITY, both_ways
from rebody.tasks.plane import PLANE
from rebody.training.inference.config import MetaConfig


def position() -> MetaConfig:
    """Reach a hidden position within +-10 m on the mass-damper, reward -|error| (thesis 6.3.1).

    The encoder sees x and the reward alone: velocity would add nothing but a robot's gait.
    """
    return MetaConfig(
        families=FamilySet((GOAL.within(*both_ways(0.0, 10.0), law="plain"),)),
        inference=InferenceConfig(fields=("x",), scales=(10.0,), reward_scale=10.0, latent=2),
        sac=high_level_sac(projections=8, decay_updates=65_000),
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
        families=FamilySet((GOAL.within(interval(0.0, 10.0), law="plain"),)),
        inference=replace(base.inference, latent=1),
        policy_fields=("x",),
        policy_scales=(10.0,),
        randomisation=CALM,
        start=(12.0, 0.0),
        turn_probability=0.02,
    )


def goal_velocity() -> MetaConfig:
    """Reach a hidden position or run at a hidden speed, front or back (thesis 6.4.2), told apart without labels.

    Inference and policy learn together to the end: a policy that goes on alone finds ways of standing still that the
    encoder has never seen, and drifts with its beliefs.
    """
    return MetaConfig(
        families=FamilySet((GOAL, VELOCITY)),
        inference=InferenceConfig(fields=("x", "vx"), scales=(10.0, 3.0), reward_scale=1.0, latent=6, kinds=2),
        sac=high_level_sac(projections=16, decay_updates=80_000),
        prior="mixture",
        arrival=0.05,
        arrival_width=0.02,
        policy_fields=("vx",),
        policy_scales=(3.0,),
        start=(15.0, 3.0),
        disturbed_start=(30.0, 3.0),
        turn_probability=0.08,
        switch_share=0.5,
        episodes=96,
        wander_iterations=25,
        joint_iterations=125,
        policy_iterations=0,
        policy_updates=640,
    )


def goal_velocity_thesis() -> MetaConfig:
    """`goal-velocity` on the ranges of the thesis' code: +-[1, 25] m and +-[0.5, 3] m/s."""
    base = goal_velocity()
    return replace(
        base,
        families=FamilySet((GOAL.within(*both_ways(1.0, 25.0)), VELOCITY.within(*both_ways(0.5, 3.0)))),
        inference=replace(base.inference, scales=(17.0, 3.0)),
        start=(25.0, 3.0),
        disturbed_start=(50.0, 3.0),
    )


def goal_velocity_noise_0() -> MetaConfig:
    """`goal-velocity` without ripple, lag and gain: nothing disturbs the toy."""
    return _noisy(0.0)


def goal_velocity_noise_01() -> MetaConfig:
    """`goal-velocity` with the thesis' observation noise of variance 0.1 in their place."""
    return _noisy(0.1)


def goal_velocity_noise_02() -> MetaConfig:
    """`goal-velocity` with the thesis' observation noise of variance 0.2 in their place."""
    return _noisy(0.2)


def goal_velocity_stand() -> MetaConfig:
    """`goal-velocity`, or stand at a hidden pitch, front or back, on the full toy (thesis 6.5.2)."""
    base = goal_velocity()
    return replace(
        base,
        families=FamilySet((GOAL, VELOCITY, STAND)),
        toy="full",
        inference=replace(base.inference, fields=("x", "vx", "pitch"), scales=(10.0, 3.0, 1.5), latent=9, kinds=3),
        policy_fields=("vx", "pitch", "pitch_rate"),
        policy_scales=(3.0, 1.5, 3.0),
        disturbed_start=None,
        joint_iterations=95,
        sac=replace(base.sac, decay_updates=61_000),
    )


def goal_velocity_jump() -> MetaConfig:
    """`goal-velocity`, or leave the floor at a hidden vertical speed, on the full toy (thesis B.2)."""
    base = goal_velocity_stand()
    return replace(
        base,
        families=FamilySet((GOAL, VELOCITY, JUMP)),
        inference=replace(base.inference, fields=("x", "vx", "vz"), scales=(10.0, 3.0, 3.0)),
        policy_fields=("vx", "z", "vz"),
        policy_scales=(3.0, 0.5, 3.0),
    )


def plane() -> MetaConfig:
    """Reach a hidden place, move at a hidden velocity or face a hidden direction, all in the plane (thesis 6.6)."""
    return replace(
        goal_velocity(),
        families=PLANE,
        toy="plane",
        inference=InferenceConfig(
            fields=("x", "y", "vx", "vy", "yaw"),
            scales=(10.0, 10.0, 2.0, 2.0, 1.0),
            reward_scale=1.0,
            latent=12,
            kinds=3,
        ),
        policy_fields=("vx", "vy", "yaw_rate"),
        policy_scales=(3.0, 3.0, 2.0),
        start=(15.0, 2.0),
        disturbed_start=None,
        home_share=0.5,
        acts_by="task",
        wander_iterations=5,
        joint_iterations=55,
        evaluate_every=20,
        held_out=100,
        held_out_s=30.0,
    )


def plane_any() -> MetaConfig:
    """`plane`, whatever way rewards are paid: laws are drawn anew for each episode."""
    return _hearing_any_law(plane())


def goal_velocity_any() -> MetaConfig:
    """`goal-velocity` with laws drawn anew for each episode; its policy is told tasks, as beliefs are sharp."""
    base = replace(goal_velocity(), acts_by="task", home_share=0.5, wander_iterations=5, joint_iterations=55)
    return _hearing_any_law(replace(base, evaluate_every=20, held_out=100))


def _hearing_any_law(base: MetaConfig) -> MetaConfig:
    inference = replace(base.inference, hears_any_law=True, decoded=16)
    return replace(base, inference=inference, evaluate_every=30, held_out_at_end=200)


def _noisy(variance: float) -> MetaConfig:
    return replace(goal_velocity(), randomisation=CALM, observation_noise=variance)


PRESETS: dict[str, Callable[[], MetaConfig]] = {
    "position": position,
    "position-thesis": position_thesis,
    "goal-velocity": goal_velocity,
    "goal-velocity-thesis": goal_velocity_thesis,
    "goal-velocity-noise-0": goal_velocity_noise_0,
    "goal-velocity-noise-0.1": goal_velocity_noise_01,
    "goal-velocity-noise-0.2": goal_velocity_noise_02,
    "goal-velocity-stand": goal_velocity_stand,
    "goal-velocity-jump": goal_velocity_jump,
    "plane": plane,
    "goal-velocity-any": goal_velocity_any,
    "plane-any": plane_any,
}
