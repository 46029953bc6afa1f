"""Settings of a flat policy's training run."""

from dataclasses import dataclass, field

from rebody.control.sac import SACConfig
from rebody.control.tracker import TrackerReward
from rebody.ranges import Decisions
from rebody.training.off_policy import OffPolicyConfig


@dataclass(frozen=True, kw_only=True)
class FlatConfig(OffPolicyConfig):
    """One training run of a flat policy; robots, steps and updates are a tracker's."""

    decisions: Decisions = 200
    """Length of an episode: 20 s, as long as it will be used."""
    reward: TrackerReward = field(default_factory=TrackerReward)
    """What the policy is paid: as a tracker that is told the hidden task."""
    sac: SACConfig = field(default_factory=lambda: SACConfig(projections=8, decay_updates=180_000))
    """Hyperparameters of soft actor-critic."""
