"""Decisions of a log: positions between samples, velocities of displacements, means of rewards."""

import numpy as np
import pytest

from rebody.evaluation.logs import resample
from rebody.types import ANGLES

FIELDS = ("x", "vx")


@pytest.mark.parametrize("every", [0.1, 0.05, 0.02, 0.03, 0.001])
def test_a_tick_every_tenth_of_a_second(every, log):
    decisions = resample(log(every=every, seconds=2.1), FIELDS)
    np.testing.assert_allclose(decisions.time_s, 0.1 * np.arange(22), atol=1e-9)
    assert {name: len(values) for name, values in decisions.fields.items()} == {"x": 22, "vx": 22}
    assert len(decisions.reward) == 21


def test_sampled_as_decided_nothing_changes(log):
    read = log(every=0.1)
    decisions = resample(read, FIELDS)
    np.testing.assert_allclose(decisions.fields["x"], read.fields["x"], rtol=1e-12)
    np.testing.assert_allclose(decisions.reward, read.reward[1:], rtol=1e-9)


def test_velocities_are_displacements_but_for_the_first(log):
    decisions = resample(log(), FIELDS)
    x = 3 * (1 - np.exp(-decisions.time_s))
    np.testing.assert_allclose(decisions.fields["x"], x, atol=1e-9)
    np.testing.assert_allclose(decisions.fields["vx"], [3.0, *np.diff(x) / 0.1], atol=1e-6)


def test_without_positions_velocities_are_means_of_those_logged(write, log):
    time = 0.05 * np.arange(21)
    read = log(("vx",), time_s=time, position_m=time, velocity_m_s=np.arange(21.0), reward=-time)
    del read.fields["x"]
    decisions = resample(read, ("vx",))
    np.testing.assert_allclose(decisions.fields["vx"], [0.0, *np.arange(1.5, 20, 2)], atol=1e-9)


def test_rewards_are_means_of_what_steps_were_paid(log):
    time = np.array([0, 0.05, 0.1, 0.12, 0.2, 0.3, 0.34])
    rest = {"position_m": 0 * time, "velocity_m_s": 0 * time}
    decisions = resample(log(time_s=time, reward=[-9, -1, -2, -5, -10, -7, -3], **rest), FIELDS)
    np.testing.assert_allclose(decisions.reward, [-1.5, 0.2 * -5 + 0.8 * -10, -7])


def test_a_decision_without_a_sample_is_bridged(log):
    time = np.array([0, 0.1, 0.35, 0.4, 0.5, 0.6])
    decisions = resample(log(time_s=time, position_m=time, velocity_m_s=time**0, reward=-time), FIELDS)
    np.testing.assert_allclose(decisions.fields["x"], 0.1 * np.arange(7), atol=1e-9)
    np.testing.assert_allclose(decisions.fields["vx"], 1.0)
    np.testing.assert_allclose(decisions.reward[1:3], -0.35)


@pytest.mark.parametrize("angle", ANGLES)
def test_an_angle_goes_on_round(angle, log):
    time = 0.05 * np.arange(41)
    wrapped = (2.0 * time + 3.0 + np.pi) % (2 * np.pi) - np.pi
    decisions = resample(log((angle,), **{f"{angle}_rad": wrapped}), (angle,))
    np.testing.assert_allclose(np.diff(decisions.fields[angle]), 0.2, atol=1e-9)
