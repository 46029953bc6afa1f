"""Training a robot's tracker."""

from rebody.training.tracker.config import TrackerConfig
from rebody.training.tracker.presets import tracker_preset
from rebody.training.tracker.train import train_tracker

__all__ = ["TrackerConfig", "tracker_preset", "train_tracker"]
