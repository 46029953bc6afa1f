"""Training a robot's step predictor (thesis 6.4.3)."""

from rebody.training.step_predictor.config import StepPredictorConfig
from rebody.training.step_predictor.train import train_step_predictor

__all__ = ["StepPredictorConfig", "train_step_predictor"]
