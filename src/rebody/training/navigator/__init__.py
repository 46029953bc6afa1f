"""Training the navigator: the tracker of every robot that walks already."""

from rebody.training.navigator.config import NavigatorConfig
from rebody.training.navigator.train import train_navigator

__all__ = ["NavigatorConfig", "train_navigator"]
