"""Settings of a walking policy's training run."""

from dataclasses import dataclass, field

from rebody.control.sac import SACConfig
from rebody.ranges import Count, Episodes, NotNegative, Number, Positive, Seconds, Share
from rebody.training.off_policy import OffPolicyConfig
from rebody.training.walking.commands import CommandDistribution
from rebody.training.walking.reward import WalkingReward


@dataclass(frozen=True, kw_only=True)
class WalkingConfig(OffPolicyConfig):
    """One training run of a walking policy."""

    iterations: Number = 400
    """Length of the run."""
    evaluate_every: Count = 50
    """Iterations from one measurement on held-out commands to the next."""
    held_out_s: Seconds = 6.0
    """Length of the episodes of a measurement [s]; `held_out` is the number of commands."""
    final_held_out: Episodes = 500
    """Held-out commands of the figures on the card."""
    final_s: Seconds = 10.0
    """How long each is followed; under pushes twice as long [s]."""
    relabelled: Share = 0.5
    """Share of a batch whose commands are drawn anew."""
    segment_s: tuple[Positive, Positive] = (1.0, 8.0)
    """Shortest and longest time between changes of the command [s]."""
    drag_iterations: Number = 200
    """Over so many iterations the price of dragging feet grows from nothing to all of it: a robot that must lift them
    before it can walk learns to stand instead."""
    smoothing_s: NotNegative = 0.12
    """Time constant of the running mean of the speeds, which counts for half in the reward [s]."""
    push_every_s: Positive = 3.0
    """Mean time between pushes [s]."""
    push: NotNegative = 0.5
    """Largest change of a robot's speed by a push, along x and along y [m/s]."""
    commands: CommandDistribution = field(default_factory=CommandDistribution)
    """How commands are drawn."""
    reward: WalkingReward = field(default_factory=WalkingReward)
    """What the policy is paid."""
    sac: SACConfig = field(
        default_factory=lambda: SACConfig(
            decay_updates=100_000, discount=0.97, target_entropy=-0.7, initial_temperature=0.05
        )
    )
    """Hyperparameters of soft actor-critic."""
