"""Training what chooses a tracker's slot from a belief."""

from rebody.training.classifier.config import ClassifierConfig
from rebody.training.classifier.train import train_classifier

__all__ = ["ClassifierConfig", "train_classifier"]
