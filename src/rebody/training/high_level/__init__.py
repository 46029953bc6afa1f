"""Training a robot's high-level policy above its frozen tracker, on a frozen module's beliefs (thesis 5.6.2, 6.5)."""

from rebody.training.high_level.config import HighLevelConfig
from rebody.training.high_level.train import train_high_level

__all__ = ["HighLevelConfig", "train_high_level"]
