"""Settings of a training run of a robot's high-level policy."""

from dataclasses import dataclass, field, replace

from rebody.control.high_level import high_level_sac
from rebody.control.sac import SACConfig
from rebody.ranges import Copies, Count, Decisions, NotNegative, Number, Positive, Rows
from rebody.training.off_policy import OffPolicyConfig


@dataclass(frozen=True, kw_only=True)
class HighLevelConfig(OffPolicyConfig):
    """One training run of a high-level policy."""

    steps: Copies = 25
    """Decisions of each robot in an iteration."""
    updates: Count = 512
    """Updates in an iteration."""
    iterations: Number = 320
    """Length of the run."""
    evaluate_every: Count = 20
    """Iterations from one measurement on held-out tasks to the next."""
    replay: Rows = 512_000
    """Decisions kept: all of the run. Without its first ones, which tried everything, it gets worse again."""
    decisions: Decisions = 100
    """Length of an episode: 10 s."""
    arrival: NotNegative = 0.3
    """Added to the scaled reward r of a decision when r = 0: it pulls the last centimetres, and pays for a jump."""
    arrival_width: Positive = 0.1
    """Half of it is added at r = -arrival_width."""
    fall: NotNegative = 5.0
    """Taken from the reward of a decision in which the robot fell."""
    # with -1 in place of -2 nats values stay so uncertain that speeds are missed by three times as much
    sac: SACConfig = field(
        default_factory=lambda: replace(high_level_sac(projections=16, decay_updates=160_000), target_entropy=-2.0)
    )
    """Hyperparameters of soft actor-critic."""
