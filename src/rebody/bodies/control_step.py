"""Which control steps fit into a decision."""

import math

from rebody.errors import RebodyError
from rebody.types import DECISION_DT

SHORTEST = 1e-5
"""Shortest time step [s]: shorter ones take hours for a second, or are none at all."""
MOST_STEPS = 20
"""Control steps of a decision that are proposed."""
MICROSECOND = 1e-6
"""Time steps that are proposed are whole numbers of it [s]."""


def steps_per_decision(robot: str, frame_skip: int, timestep: float) -> int:
    """Control steps of one decision, each of `frame_skip` time steps [s].

    RebodyError that names what would do where they do not divide it.
    """
    if not SHORTEST <= timestep < math.inf:
        raise RebodyError(
            f"robot '{robot}': its time step is {timestep:g} s, and must be at least {SHORTEST:g} s: set timestep in "
            "its TOML file."
        )
    step = frame_skip * timestep
    steps = round(DECISION_DT / step)
    if steps < 1 or abs(steps * step - DECISION_DT) > 1e-9:
        raise RebodyError(
            f"robot '{robot}': a control step of {step:g} s does not divide a decision of {DECISION_DT} s "
            f"(frame_skip {frame_skip}, time step {timestep:g} s). {_remedy(timestep)}"
        )
    return steps


def _remedy(timestep: float) -> str:
    fitting = round(DECISION_DT / timestep)
    if fitting and abs(fitting * timestep - DECISION_DT) < 1e-9:
        return f"Choose frame_skip = {_skips(fitting)}."
    shorter, count = _next_shorter(timestep)
    return (
        f"With this time step no frame_skip does: set timestep = {shorter:g} in its TOML file and "
        f"frame_skip = {_skips(count)}."
    )


def _next_shorter(timestep: float) -> tuple[float, int]:
    """The longest time step below this one that is whole in us and divides a decision, and how often it does."""
    decision = round(DECISION_DT / MICROSECOND)
    fits = [us for us in range(1, decision + 1) if decision % us == 0 and us * MICROSECOND <= timestep]
    count = decision // max(fits, default=1)
    return DECISION_DT / count, count


def _skips(count: int) -> str:
    """What divides so many time steps into not too many control steps."""
    fits = [str(count // steps) for steps in range(MOST_STEPS, 0, -1) if count % steps == 0]
    return " or ".join(filter(None, (", ".join(fits[:-1]), fits[-1])))
