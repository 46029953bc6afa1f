"""Gymnasium environments that hide their task from the observation. Importing this is cheap."""

import sys
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rebody.envs.belief import BeliefObservation

__all__ = ["BeliefObservation", "register_environments"]

_ROBOTS = {"HalfCheetah": ("cheetah", 0.05), "Hopper": ("hopper", 0.02), "Walker2d": ("walker", 0.02)}
"""What Gymnasium calls a robot: its name here, and its control step [s]."""
_SECONDS, _DECISION_DT = 20.0, 0.1


def register_environments() -> None:
    """Tell Gymnasium where `rebody/PointMass-v0`, `rebody/HalfCheetah-v0` ... are; they load when made.

    Gymnasium is not imported for that, since a command line does without it, and it asks no package for its
    environments (no entry points): it is told as soon as it is there.
    """
    if _Gymnasium.ENVS in sys.modules:
        _register_all()
    else:
        sys.meta_path.insert(0, _Gymnasium())


class _Gymnasium(MetaPathFinder):
    """Finds Gymnasium's registry as it is found without this, and adds to it once it has been imported."""

    ENVS = "gymnasium.envs"

    def find_spec(self, fullname: str, path: Any, target: ModuleType | None = None) -> ModuleSpec | None:
        """The specification of `gymnasium.envs`, its loader made to register ours; None for any other module."""
        if fullname != self.ENVS:
            return None
        others = (finder.find_spec(fullname, path, target) for finder in sys.meta_path if finder is not self)
        spec = next((spec for spec in others if spec is not None), None)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def exec_module(module: ModuleType) -> None:
                execute(module)
                _register_all()

            spec.loader.exec_module = exec_module
        return spec


def _register_all() -> None:
    _register("PointMass", _DECISION_DT, *_bodies("PointMass"))
    for name, (robot, control_dt) in _ROBOTS.items():
        _register(name, control_dt, *_bodies("Robot"), robot=robot)
        _register(f"{name}Tracker", control_dt, "rebody.training.tracker.env:TrackerEnv", robot=robot)


def _bodies(kind: str) -> tuple[str, str]:
    """Where environments of that kind are, one alone and several at once."""
    return f"rebody.envs.shipped:{kind}Env", f"rebody.envs.shipped:{kind}VectorEnv"


def _register(name: str, step_s: float, alone: str, together: str | None = None, **settings: str) -> None:
    from gymnasium.envs.registration import register

    register(
        f"rebody/{name}-v0",
        entry_point=alone,
        vector_entry_point=together,
        kwargs=settings,
        max_episode_steps=round(_SECONDS / step_s),
    )


def __getattr__(name: str) -> Any:
    """`BeliefObservation` brings JAX with it."""
    if name == "BeliefObservation":
        from rebody.envs.belief import BeliefObservation

        return BeliefObservation
    raise AttributeError(f"module 'rebody.envs' has no attribute '{name}'")
