"""Training a flat policy on a robot, on the beliefs of a frozen inference module (thesis 6.3.2)."""

from rebody.training.flat.config import FlatConfig
from rebody.training.flat.train import train_flat

__all__ = ["FlatConfig", "train_flat"]
