"""Task families, their rewards, and how tasks are drawn. Nothing here knows a body."""

from rebody.tasks.families import (
    FAMILIES,
    GOAL,
    JUMP,
    STAND,
    VELOCITY,
    Family,
    RewardForm,
    achieved,
    achieved_by_way_of,
    base_task,
    family_index,
    family_named,
    family_names,
    reward,
)
from rebody.tasks.quantities import Quantity
from rebody.tasks.sampling import BaseTask, TaskDistribution

__all__ = [
    "FAMILIES",
    "GOAL",
    "JUMP",
    "STAND",
    "VELOCITY",
    "BaseTask",
    "Family",
    "Quantity",
    "RewardForm",
    "TaskDistribution",
    "achieved",
    "achieved_by_way_of",
    "base_task",
    "family_index",
    "family_named",
    "family_names",
    "reward",
]
