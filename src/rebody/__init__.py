"""rebody: learn to infer a task once, on a point mass; reuse that module, frozen, on any robot."""

from typing import TYPE_CHECKING, Any

import gymnasium

from rebody.envs import register_environments
from rebody.errors import RebodyError
from rebody.standard import register_environments as register_standard_tasks

if TYPE_CHECKING:
    from rebody.agents.live import load_agent
    from rebody.agents.parts import load_inference

__version__ = "0.1.0"
__all__ = ["RebodyError", "load_agent", "load_inference"]


def __getattr__(name: str) -> Any:
    """Loaders bring JAX with them, which `import rebody` alone shall not."""
    if name == "load_agent":
        from rebody.agents.live import load_agent

        return load_agent
    if name == "load_inference":
        from rebody.agents.parts import load_inference

        return load_inference
    raise AttributeError(f"module 'rebody' has no attribute '{name}'")


def _tracker_env(**settings: Any) -> gymnasium.Env:
    """It brings JAX with it, too."""
    from rebody.training.tracker.env import TrackerEnv

    return TrackerEnv(**settings)


register_environments(tracker_env=f"{__name__}:{_tracker_env.__name__}")
register_standard_tasks()
