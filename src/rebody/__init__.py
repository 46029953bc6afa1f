"""rebody: learn to infer a task once, on a point mass; reuse that module, frozen, on any robot."""

from typing import TYPE_CHECKING, Any

from rebody.envs import register_environments
from rebody.errors import RebodyError

if TYPE_CHECKING:
    from rebody.agents.live import load_agent

__version__ = "0.1.0"
__all__ = ["RebodyError", "load_agent"]

register_environments()


def __getattr__(name: str) -> Any:
    """`load_agent` brings JAX with it, which `import rebody` alone shall not."""
    if name == "load_agent":
        from rebody.agents.live import load_agent

        return load_agent
    raise AttributeError(f"module 'rebody' has no attribute '{name}'")
