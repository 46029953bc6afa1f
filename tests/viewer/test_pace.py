"""Simulated time keeps step with the clock."""

import pytest

from rebody.viewer.pace import LONGEST_S, Pace


@pytest.mark.parametrize(("step_s", "frame_s", "speed"), [(0.05, 0.025, 1.0), (0.02, 0.031, 1.0), (0.1, 0.025, 0.3)])
def test_as_many_steps_as_time_has_passed(step_s, frame_s, speed):
    pace = Pace(step_s, now=7.0)
    frames = round(3.0 / frame_s)
    steps = [pace.due(7.0 + frame_s * (i + 1), speed) for i in range(frames)]
    assert sum(steps) == pytest.approx(frames * frame_s * speed / step_s, abs=1.01)
    assert max(steps) - min(steps) <= 1
    assert pace.reached == pytest.approx(speed, rel=0.15)


def test_a_moment_lies_between_two_steps():
    pace = Pace(0.1, now=0.0)
    assert pace.due(0.13, 1.0) == 1
    assert pace.share == pytest.approx(0.3)


def test_after_a_stall_nothing_races():
    pace = Pace(0.05, now=0.0)
    assert pace.due(60.0, 1.0) == round(LONGEST_S / 0.05)
    assert pace.due(60.05, 1.0) == 1


def test_waiting_costs_no_time():
    pace = Pace(0.05, now=0.0)
    pace.wait(30.0)
    assert pace.due(30.05, 1.0) == 1
