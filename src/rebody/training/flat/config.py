"""Settings of a flat policy's training run."""

from dataclasses import dataclass, field

from rebody.control.sac import SACConfig
from rebody.control.tracker import TrackerReward
from rebody.ranges import Copies, Count, Decisions, Number, Rows


@dataclass(frozen=True)
class FlatConfig:
    """One training run of a flat policy; robots, steps and updates are a tracker's."""

    robots: Copies = 64
    """Copies that move in parallel."""
    steps: Copies = 32
    """Control steps of each robot in an iteration."""
    updates: Count = 256
    """Updates in an iteration."""
    iterations: Number = 700
    """Length of the run."""
    evaluate_every: Count = 50
    """Iterations from one measurement on held-out tasks to the next."""
    replay: Rows = 500_000
    """Transitions kept."""
    decisions: Decisions = 200
    """Length of an episode: 20 s, as long as it will be used."""
    reward: TrackerReward = field(default_factory=TrackerReward)
    """What the policy is paid: as a tracker that is told the hidden task."""
    sac: SACConfig = field(default_factory=lambda: SACConfig(projections=8, decay_updates=180_000))
    """Hyperparameters of soft actor-critic."""
