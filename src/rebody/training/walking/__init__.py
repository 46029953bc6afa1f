"""Training a robot's walking policy: it follows a joystick."""

from rebody.training.walking.config import WalkingConfig
from rebody.training.walking.train import train_walking

__all__ = ["WalkingConfig", "train_walking"]
