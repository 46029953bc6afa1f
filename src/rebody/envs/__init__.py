"""Gymnasium environments that hide their task from the observation. Importing this is cheap."""

from typing import TYPE_CHECKING, Any

import gymnasium

if TYPE_CHECKING:
    from rebody.envs.belief import BeliefObservation

__all__ = ["BeliefObservation", "register_environments"]

_ROBOTS = {"HalfCheetah": ("cheetah", 0.05), "Hopper": ("hopper", 0.02), "Walker2d": ("walker", 0.02)}
"""What Gymnasium calls a robot: its name here, and its control step [s]."""
_SECONDS, _DECISION_DT = 20.0, 0.1


def register_environments(tracker_env: str) -> None:
    """Tell Gymnasium where `rebody/PointMass-v0`, `rebody/HalfCheetah-v0` ... are; they load when made.

    `tracker_env` is what makes the learning problem of a robot's tracker, which is on a floor above this one:
    MODULE:FUNCTION of the caller, since Gymnasium cannot serialise the specification of a function itself.
    """
    _register("PointMass", "PointMass", _DECISION_DT, {})
    for name, (robot, control_dt) in _ROBOTS.items():
        _register(name, "Robot", control_dt, {"robot": robot})
        gymnasium.register(
            f"rebody/{name}Tracker-v0",
            entry_point=tracker_env,
            kwargs={"robot": robot},
            max_episode_steps=round(_SECONDS / control_dt),
        )


def _register(name: str, kind: str, step_s: float, settings: dict[str, str]) -> None:
    gymnasium.register(
        f"rebody/{name}-v0",
        entry_point=f"rebody.envs.shipped:{kind}Env",
        vector_entry_point=f"rebody.envs.shipped:{kind}VectorEnv",
        kwargs=settings,
        max_episode_steps=round(_SECONDS / step_s),
    )


def __getattr__(name: str) -> Any:
    """`BeliefObservation` brings JAX with it."""
    if name == "BeliefObservation":
        from rebody.envs.belief import BeliefObservation

        return BeliefObservation
    raise AttributeError(f"module 'rebody.envs' has no attribute '{name}'")
