"""A tracker can be told only what it has a slot for; the families of modules are checked with their contracts."""

from dataclasses import replace

import pytest

from rebody.errors import RebodyError
from rebody.evaluation import evaluate
from rebody.evaluation.evaluate import take_yardsticks
from rebody.evaluation.trial import check_trial
from rebody.tasks import FamilySet, line
from rebody.tasks.task_file import Switch, TaskSpec
from rebody.viewer.session import Session

JUMP, STAND = TaskSpec("jump", (1.5,)), TaskSpec("stand", (1.0,))
LATER = TaskSpec("goal", (2.0,), Switch(1.0, "jump", (1.5,)))


@pytest.mark.parametrize(("specs", "what"), [([JUMP], "jump"), ([LATER], "jump"), ([STAND, JUMP, JUMP], "stand, jump")])
def test_an_oracle_is_refused(trial, specs, what):
    said = rf"agent 'oracle' is told {what}, and tracker 'tiny-tracker' has no slot for that \(it has goal, velocity\)"
    oracle = replace(trial, agent="oracle")
    for refused in (check_trial, lambda trial, specs: evaluate(trial, specs, 1)):
        with pytest.raises(RebodyError, match=said):
            refused(oracle, [TaskSpec("velocity", (1.0,)), *specs])


def test_on_the_live_page_too(trial):
    session = Session(replace(trial, agent="oracle"), TaskSpec("goal", (2.0,)))
    with pytest.raises(RebodyError, match="'oracle' is told jump"):
        session.set_task(JUMP)
    assert session.task == TaskSpec("goal", (2.0,))


@pytest.mark.parametrize("agent", ["reuse", "readout", "bayes", "flat"])
def test_the_others_cannot_infer_it(trial, agent):
    with pytest.raises(RebodyError, match="'tiny' was trained on goal and cannot infer 'jump'"):
        check_trial(replace(trial, agent=agent), [JUMP])


@pytest.mark.parametrize("agent", ["reuse", "readout", "bayes", "flat"])
def test_nor_has_their_module_more_families_than_slots(trial, agent):
    jumps = replace(trial.inference.contract, families=FamilySet((line.JUMP,)))
    with pytest.raises(RebodyError, match="the tracker has no slot for jump"):
        check_trial(replace(trial, agent=agent, inference=replace(trial.inference, contract=jumps)), [JUMP])


def test_standing_still_needs_no_slot_and_has_no_oracle_beside_it(trial):
    idle = replace(trial, agent="idle")
    assert take_yardsticks(idle, [JUMP], 1).oracle is None
    results = evaluate(idle, [JUMP], 1)
    assert results.summary["regret"] is None
    assert results.episodes[0].oracle_return is None
    assert results.episodes[0].idle_return == pytest.approx(results.episodes[0].return_)
