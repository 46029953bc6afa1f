"""Training a robot's tracker."""

from rebody.training.tracker.config import TrackerConfig
from rebody.training.tracker.train import train_tracker

__all__ = ["TrackerConfig", "train_tracker"]
