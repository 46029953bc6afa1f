"""Small networks."""

from rebody.nn.gru import GRU
from rebody.nn.mlp import MLP
from rebody.nn.multiscale import MultiScale

__all__ = ["GRU", "MLP", "MultiScale"]
