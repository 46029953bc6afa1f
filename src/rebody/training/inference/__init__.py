"""Meta-training of the inference module and the high-level policy on a toy."""

from rebody.training.inference.config import MetaConfig
from rebody.training.inference.presets import PRESETS
from rebody.training.inference.train import train_inference

__all__ = ["PRESETS", "MetaConfig", "train_inference"]
