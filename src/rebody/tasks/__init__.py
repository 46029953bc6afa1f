"""Task families, their rewards, and how tasks are drawn. Nothing here knows a body."""

from rebody.tasks.families import (
    FAMILIES,
    GOAL,
    VELOCITY,
    Family,
    RewardForm,
    family_index,
    family_names,
    reward,
)
from rebody.tasks.sampling import BaseTask, TaskDistribution

__all__ = [
    "FAMILIES",
    "GOAL",
    "VELOCITY",
    "BaseTask",
    "Family",
    "RewardForm",
    "TaskDistribution",
    "family_index",
    "family_names",
    "reward",
]
