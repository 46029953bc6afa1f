"""How long orders and trajectories last: ours, or the thesis' curriculum (6.4.1)."""

import math
from dataclasses import dataclass, replace

from rebody.training.tracker.config import TrackerConfig


@dataclass(frozen=True)
class Schedule:
    """What holds at one time of a run; lengths in control steps."""

    trajectory: float
    """After which a robot begins anew in its rest pose; infinite for never."""
    segment: tuple[int, int]
    """Shortest and longest order."""
    change_when_reached: float
    """Chance per control step that an order that is carried out is replaced by a new one."""
    speed_share: float = 1.0
    """How much of the range of speeds is asked for."""


REACHED = 0.1
"""Within this an order counts as carried out [m, m/s, rad]."""
NARROWEST = 0.25
"""Share of the range of speeds that widening begins with."""
_EASY = Schedule(trajectory=300.0, segment=(300, 300), change_when_reached=0.0)
_HARD = Schedule(trajectory=1000.0, segment=(125, 125), change_when_reached=0.2)


def schedule(config: TrackerConfig, iteration: int, control_dt: float) -> Schedule:
    """That of an iteration."""
    if config.curriculum_iterations:
        lasting = _EASY if iteration < config.curriculum_iterations else _HARD
    else:
        lasting = Schedule(math.inf, segment_steps(config, control_dt), 0.0)
    return replace(lasting, speed_share=speed_share(config, iteration))


def speed_share(config: TrackerConfig, iteration: int) -> float:
    """Share of the range of speeds that is asked for in an iteration."""
    done = iteration / config.widening_iterations if config.widening_iterations else 1.0
    return min(1.0, NARROWEST + (1 - NARROWEST) * done)


def segment_steps(config: TrackerConfig, control_dt: float) -> tuple[int, int]:
    """Shortest and longest order without the curriculum [control steps]."""
    shortest, longest = config.segment_s
    return round(shortest / control_dt), round(longest / control_dt)
