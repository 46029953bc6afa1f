"""A module says what it needs, and is not attached where that is missing."""

import json
from dataclasses import asdict, replace

import pytest

from rebody.errors import RebodyError
from rebody.inference.contract import Contract
from rebody.store.typed import typed
from rebody.tasks import FamilySet
from rebody.tasks.line import GOAL, VELOCITY

CONTRACT = Contract(fields=("x", "pitch"), window=32, families=FamilySet((VELOCITY, GOAL)))
FIELDS, SLOTS = ("x", "vx", "pitch"), ("goal", "velocity")


def test_survives_its_file():
    again = typed(json.loads(json.dumps(asdict(CONTRACT))), Contract)
    assert again == CONTRACT
    assert again.families.names == ("velocity", "goal")
    assert again.families.named("goal") == GOAL  # whole: ranges, law, directions


def test_a_body_that_fits():
    CONTRACT.check_body("robot", FIELDS, SLOTS)


MISFITS = {
    "encoder sees pitch, which 'robot' does not have": (CONTRACT, ("x", "vx"), SLOTS),
    "encoder sees x, pitch, which": (CONTRACT, (), SLOTS),
    r"no slot for velocity \(it has goal\)": (CONTRACT, FIELDS, ("goal",)),
    r"a decision every 0\.05 s, here one takes 0\.1 s": (replace(CONTRACT, decision_dt=0.05), FIELDS, SLOTS),
}


@pytest.mark.parametrize("said", MISFITS)
def test_a_misfit_is_named(said):
    contract, fields, slots = MISFITS[said]
    with pytest.raises(RebodyError, match=said) as error:
        contract.check_body("robot", fields, slots)
    assert ";" not in str(error.value)  # nothing else is blamed


def test_all_misfits_are_named_at_once():
    with pytest.raises(RebodyError, match="does not fit 'robot'") as error:
        replace(CONTRACT, decision_dt=0.05).check_body("robot", ("x",), ("velocity",))
    assert all(part in str(error.value) for part in ("every 0.05 s", "sees pitch", "no slot for goal"))
