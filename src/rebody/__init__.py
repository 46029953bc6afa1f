"""rebody: learn to infer a task once, on a point mass; reuse that module, frozen, on any robot."""

from rebody.envs import register_environments

__version__ = "0.1.0"

register_environments()
