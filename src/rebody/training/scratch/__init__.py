"""Training inference module and policy together on a robot, nothing reused: what reuse is compared with."""

from rebody.training.scratch.config import ScratchConfig
from rebody.training.scratch.train import train_scratch

__all__ = ["ScratchConfig", "train_scratch"]
