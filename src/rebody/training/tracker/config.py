"""Settings of a tracker's training run."""

from dataclasses import dataclass, field

from rebody.control.sac import SACConfig
from rebody.control.tracker import TrackerReward
from rebody.ranges import Copies, Count, NotNegative, Number, Positive, Seconds, Share
from rebody.tasks import FamilySet
from rebody.training.off_policy import OffPolicyConfig
from rebody.training.tracker.commands import CommandDistribution


@dataclass(frozen=True, kw_only=True)
class TrackerConfig(OffPolicyConfig):
    """One training run of a tracker."""

    families: FamilySet
    """What is asked of the robot, within its reach but for a margin."""
    evaluate_every: Count = 100
    """Iterations from one measurement on held-out commands to the next."""
    held_out_s: Seconds = 10.0
    """Length of the episodes of a measurement [s]; `held_out` is the number of commands per slot."""
    relabelled: Share = 0.5
    """Share of a batch whose commands are drawn anew."""
    segment_s: tuple[Positive, Positive] = (1.0, 8.0)
    """Shortest and longest time between changes of the command (thesis 6.3.3) [s]."""
    curriculum_iterations: Number = 0
    """The thesis' curriculum (6.4.1) in place of `segment_s`: for so many iterations an order lasts for a trajectory of
    300 control steps; then trajectories of 1000, a new order every 125, and often once one is reached. 0 for none."""
    widening_iterations: Number = 0
    """Over so many iterations the speeds asked for widen from a quarter of the robot's reach to all of it: asked for
    too much too early, a robot that has to balance learns to stand still instead."""
    guided_share: Share = 0.25
    """Share of commands that come from a toy ahead of the robot, renewed at every decision."""
    max_horizon: Copies = 15
    """Farthest look ahead of that toy [decisions]."""
    push_every_s: Positive = 4.0
    """Mean time between pushes [s]."""
    push: NotNegative = 0.3
    """Largest change of a robot's speed by a push, either way [m/s]."""
    commands: CommandDistribution = field(default_factory=CommandDistribution)
    """How commands are drawn."""
    reward: TrackerReward = field(default_factory=TrackerReward)
    """What the tracker is paid."""
    sac: SACConfig = field(default_factory=lambda: SACConfig(decay_updates=180_000))
    """Hyperparameters of soft actor-critic."""
