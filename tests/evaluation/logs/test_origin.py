"""A log that begins far away is read relative to its first row."""

import numpy as np
import pytest

from rebody.evaluation.logs import begun_at_zero
from rebody.inference.contract import Contract
from rebody.ranges import interval
from rebody.tasks import FamilySet
from rebody.tasks.line import GOAL, VELOCITY

CONTRACT = Contract(("x", "vx"), 32, FamilySet((GOAL.within(interval(-15.0, 12.0)), VELOCITY)))
TIME = 0.05 * np.arange(41)


@pytest.mark.parametrize("start", [100.0, -15.5])
def test_beyond_the_goals_of_the_training(start, log):
    read = log(position_m=start + TIME)
    shifted = begun_at_zero(read, CONTRACT)
    np.testing.assert_allclose(shifted.fields["x"], TIME, atol=1e-9)
    np.testing.assert_array_equal(shifted.fields["vx"], read.fields["vx"])
    (note,) = shifted.notes
    assert note.startswith(f"position_m begins at {start:g} m, and the module knows places up to 15 m")
    assert f"{start:g} m less than in the log" in note


@pytest.mark.parametrize("start", [0.0, 15.0, -14.0])
def test_within_them_nothing_changes(start, log):
    shifted = begun_at_zero(log(position_m=start + TIME), CONTRACT)
    assert shifted.fields["x"][0] == start
    assert shifted.notes == ()


def test_a_module_without_goals(log):
    contract = Contract(("vx",), 32, FamilySet((VELOCITY,)))
    assert begun_at_zero(log(("vx",), position_m=14 + TIME), contract).notes == ()
    assert begun_at_zero(log(("vx",), position_m=16 + TIME), contract).fields["x"][0] == 0.0


def test_a_side_position(log):
    contract = Contract(("x", "y"), 32, FamilySet((GOAL,)))
    shifted = begun_at_zero(log(("x", "y"), position_y_m=-200 + TIME), contract)
    np.testing.assert_allclose(shifted.fields["y"], TIME, atol=1e-9)
    assert shifted.notes[0].startswith("position_y_m begins at -200 m")
