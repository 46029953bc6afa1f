"""What a tracker is measured by."""

import jax
import numpy as np
import pytest

from rebody.bodies import load_robot
from rebody.control.command import commands_within
from rebody.control.sac import Actor, SACConfig
from rebody.control.tracker import Tracker
from rebody.ranges import interval
from rebody.tasks import SHIPPED
from rebody.training.tracker import TrackerConfig
from rebody.training.tracker.report import measure, speeds_within


@pytest.mark.parametrize(("ends", "backward"), [((-3.0, 3.0), 0.5), ((-1.0, 3.0), 0.7 / 3.4), ((-0.2, 3.0), 0.0)])
def test_held_out_speeds_fill_the_reach_but_for_the_slowest(ends, backward):
    speeds = speeds_within(interval(*ends), 4000, np.random.default_rng(0))
    assert np.mean(speeds < 0) == pytest.approx(backward, abs=0.03)
    assert np.abs(speeds).min() == pytest.approx(0.3, abs=0.01)
    assert speeds.max() == pytest.approx(3.0, abs=0.01)
    assert speeds.min() == pytest.approx(ends[0] if backward else 0.3, abs=0.01)


@pytest.mark.parametrize("ends", [(-0.2, 0.2), (0.5, 3.0), (-3.0, -0.5)])
def test_no_speed_beyond_the_reach_is_held_out(ends):
    """Of a slow robot, and of one that cannot stand still."""
    speeds = speeds_within(interval(*ends), 100, np.random.default_rng(0))
    assert ((speeds >= ends[0]) & (speeds <= ends[1])).all()


def test_a_tracker_that_does_nothing_misses_by_what_was_asked():
    ends = {"goal": 5.0, "velocity": 3.0, "stand": 1.0}
    reach = tuple((name, interval(-end, end)) for name, end in ends.items())
    cheetah, families = load_robot("cheetah"), commands_within(reach, SHIPPED)
    still = jax.tree.map(lambda leaf: 0 * leaf, Actor(17 + 10, 6, SACConfig(hidden=(4,)), jax.random.key(0)))
    figures = measure(Tracker(still, families), cheetah, TrackerConfig(families=families, held_out_s=3.0))
    assert figures.keys() == {
        "goal median", "goal p95", "velocity median", "velocity p95", "stand median", "stand p95", "zero speed", "fell",
    }  # fmt: skip
    assert figures["goal median"] == pytest.approx(2.5, abs=0.7)
    assert figures["velocity median"] == pytest.approx(1.65, abs=0.4)
    assert figures["stand median"] == pytest.approx(0.5, abs=0.2)
    assert figures["zero speed"] < 0.05
    assert figures["fell"] == 0.0
