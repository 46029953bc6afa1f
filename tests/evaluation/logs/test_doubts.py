"""What can be read and is odd is said."""

from dataclasses import replace

import numpy as np
import pytest

from rebody.evaluation.logs import doubts, resample
from rebody.inference.contract import Contract
from rebody.ranges import Box, interval
from rebody.tasks import FamilySet, Quantity
from rebody.tasks.line import GOAL, STAND, VELOCITY

FIELDS = ("x", "vx")
CONTRACT = Contract(FIELDS, 32, FamilySet((GOAL, VELOCITY)))
TIME = 0.05 * np.arange(41)


@pytest.fixture
def said(log):
    """A function: what differs in a log -> what is said of it."""

    def said(contract=CONTRACT, **different):
        read = log(contract.fields, **different)
        return doubts(read, resample(read, contract.fields), contract)

    return said


def test_nothing_of_a_plausible_log(said):
    assert said() == []


def test_nothing_of_one_who_ran_for_a_whole_episode(said):
    time = 0.1 * np.arange(201)
    assert said(time_s=time, position_m=3 * time, velocity_m_s=3 + 0 * time, reward=0 * time) == []


def test_nothing_of_noise_at_rest(said):
    noise = 0.03 * np.random.default_rng(0).standard_normal(41)
    assert said(position_m=0 * TIME, velocity_m_s=noise) == []


@pytest.mark.parametrize("factor", [3.6, 1000, -1, 0])
def test_a_velocity_in_another_unit_or_direction(factor, said):
    doubt, *_ = said(velocity_m_s=factor * 3 * np.exp(-TIME))
    assert doubt.startswith("velocity_m_s says")
    assert "position_m moves at" in doubt


def test_places_in_millimetres(said):
    disagree, *others = said(position_m=3000 * (1 - np.exp(-TIME)))
    place, velocity = sorted(others)
    assert disagree.startswith("velocity_m_s says")
    assert velocity.startswith("velocity_m_s reaches 2.85e+03")
    assert place.startswith("position_m reaches 2.59e+03")
    assert "goal from -15 to 15 m, velocity from -3 to 3 m/s" in place


def test_degrees(said):
    contract = Contract(("pitch",), 32, FamilySet((STAND.within(interval(-1.5, 1.5)),)))
    assert said(contract, pitch_rad=0.9 * np.sin(TIME)) == []
    (doubt,) = said(contract, pitch_rad=45 * TIME)
    assert doubt.startswith("pitch_rad reaches")


def test_each_number_of_a_vector_has_a_range_of_its_own(said):
    """A place of the floor, which is as far as a speed along it leads in an episode."""
    place = replace(
        GOAL, name="place", quantity=Quantity("x_pitch", ("x", "pitch"), "m, rad", "place and pitch"),
        targets=(Box((-15.0, -0.5), (12.0, 0.4)),), directions=(),
    )  # fmt: skip
    contract = Contract(("x", "pitch"), 32, FamilySet((place,)))
    assert said(contract, pitch_rad=0.7 * np.sin(TIME)) == []
    (doubt,) = said(contract, pitch_rad=45 * TIME)
    assert "the module learned place from -15 to 12 and -0.5 to 0.4 m, rad" in doubt
