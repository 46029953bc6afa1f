"""rebody: learn to infer a task once, on a point mass; reuse that module, frozen, on any robot."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from rebody.envs import register_environments
from rebody.errors import RebodyError

if TYPE_CHECKING:
    from rebody.agents.live import load_agent
    from rebody.agents.parts import load_inference

__version__ = "0.1.0"
__all__ = ["RebodyError", "load_agent", "load_inference"]

register_environments(trackers="rebody.training.tracker.env:TrackerEnv")


_LOADERS = {"load_agent": "rebody.agents.live", "load_inference": "rebody.agents.parts"}


def __getattr__(name: str) -> Any:
    """Loaders bring JAX with them, which `import rebody` alone shall not."""
    if name in _LOADERS:
        return getattr(import_module(_LOADERS[name]), name)
    raise AttributeError(f"module 'rebody' has no attribute '{name}'")
