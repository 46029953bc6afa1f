"""A tracker's settings for each kind of robot; the command line has the last word."""

import math
from dataclasses import replace

from rebody.bodies import RobotSpec
from rebody.control.command import commands_within
from rebody.control.tracker import TrackerReward
from rebody.tasks import SHIPPED, FamilySet
from rebody.training.tracker.config import TrackerConfig

FAST = 2.5
"""A robot that has to balance and is to run faster than this [m/s] is told to go slowly first."""


def tracker_preset(spec: RobotSpec, known: FamilySet = SHIPPED) -> TrackerConfig:
    """Settings for a robot that lies on its belly when it does nothing, or for one that has to balance.

    RebodyError where its reach is about a family that is not known.
    """
    families = commands_within(spec.reach, known)
    sprawling = TrackerConfig(families=families)
    if len(families) > 2:  # a slot more is more to learn
        sprawling = replace(sprawling, iterations=1100, sac=replace(sprawling.sac, decay_updates=280_000))
    if spec.fall.min_height < 0:
        return sprawling
    balancing = replace(
        sprawling,
        # told of a far goal by its distance alone, it learns to stand there; relative errors make it walk, unless
        # staying alive pays more, or values grow large (a longer discount): it then fails to explore walking
        reward=TrackerReward(relative=0.5, arrival=0.2, alive=0.1),
    )
    if not spec.smoothing_s:
        return balancing
    return replace(
        balancing,
        iterations=1700,
        widening_iterations=300 if _fastest(families) > FAST else 0,
        push_every_s=3.0,
        sac=replace(balancing.sac, decay_updates=435_000),
    )


def _fastest(families: FamilySet) -> float:
    """Of the speeds that are held, over the ground [m/s]; 0 for none."""
    ground = [family.range.largest for family in families if set(family.quantity.components) & {"vx", "vy"}]
    return max((math.hypot(*largest) for largest in ground), default=0.0)
