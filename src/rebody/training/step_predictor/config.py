"""Settings of a step predictor's training run."""

from dataclasses import dataclass, field

from rebody.control.sac import SACConfig
from rebody.ranges import Copies, Count, Number, Rows, Share
from rebody.training.off_policy import OffPolicyConfig
from rebody.training.tracker.commands import CommandDistribution


@dataclass(frozen=True, kw_only=True)
class StepPredictorConfig(OffPolicyConfig):
    """One training run of a step predictor; `held_out` is the number of robots of a measurement."""

    steps: Copies = 64
    """Control steps of each robot in an iteration; at least as many as a subgoal can last, 20."""
    updates: Count = 128
    """Updates in an iteration."""
    iterations: Number = 60
    """Length of the run."""
    replay: Rows = 200_000
    """Transitions kept; one is a subgoal, however long it was held."""
    change_probability: Share = 0.05
    """Chance per subgoal that the task changes to which the toy leads its robot."""
    tasks: CommandDistribution = field(default_factory=CommandDistribution)
    """How those tasks are drawn: as a tracker's commands, goals and speeds alike."""
    sac: SACConfig = field(default_factory=lambda: SACConfig(hidden=(64,) * 5, discount=0.9, decay_updates=7_680))
    """Hyperparameters of soft actor-critic, its discount per subgoal."""
