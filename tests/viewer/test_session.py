"""A session does what an evaluated episode does, and more can be done to it."""

from dataclasses import replace

import numpy as np
import pytest

from rebody.errors import RebodyError
from rebody.evaluation.evaluate import run_trial, trial_agent
from rebody.ranges import Box, interval
from rebody.tasks import SHIPPED, Family, FamilySet, Quantity
from rebody.tasks.task_file import Switch, TaskSpec, active_tasks
from rebody.types import DECISION_DT
from rebody.viewer.session import Session, fitting, target_range

TASK, OTHER = TaskSpec("goal", (3.0,)), TaskSpec("goal", (-2.0,))
DECISIONS, CHANGE = 12, 5


@pytest.fixture(scope="module")
def session(trial):
    return Session(trial, TASK)


@pytest.fixture(scope="module")
def toy_session(trial):
    return Session(replace(trial, robot=None, tracker=None), TASK)


@pytest.fixture(params=["session", "toy_session"])
def fresh(request):
    """At its start."""
    session = request.getfixturevalue(request.param)
    session.set_task(TASK)
    session.restart()
    return session


def decide(session: Session, decisions: int) -> None:
    for _ in range(decisions * session.body.steps_per_decision):
        session.step()


def test_a_session_is_an_episode_whose_task_changes(fresh):
    decide(fresh, CHANGE)
    fresh.set_task(OTHER)
    decide(fresh, DECISIONS - CHANGE)
    spec = replace(TASK, switch=Switch(CHANGE * DECISION_DT, OTHER.family, OTHER.target))
    tasks = active_tasks([spec], fresh.trial.in_play, DECISIONS, DECISION_DT)
    episode = run_trial(fresh.trial, trial_agent(fresh.trial, tasks), tasks, np.array([0]))
    moments = fresh.moments
    np.testing.assert_allclose([m.time_s for m in moments], DECISION_DT * np.arange(1, DECISIONS + 1))
    np.testing.assert_allclose([m.reached["goal"] for m in moments], episode.state.x, atol=1e-5)
    np.testing.assert_allclose([m.reward for m in moments], episode.reward[:, 0], atol=1e-5)
    np.testing.assert_allclose([m.reading.latent.mean for m in moments], episode.belief.mean[:, 0], atol=1e-5)
    assert [m.task for m in moments] == [TASK] * CHANGE + [OTHER] * (DECISIONS - CHANGE)


def test_a_robot_shows_what_is_asked_of_it_and_a_point_mass_is_not_asked(session, toy_session):
    for each in (session, toy_session):
        each.restart()
        decide(each, 2)
    assert session.moments[-1].subgoal.family == "goal"
    assert toy_session.moments[-1].subgoal is None


def test_the_oracle_is_told_of_a_change(trial):
    session = Session(replace(trial, agent="oracle"), TASK)
    decide(session, 1)
    assert session.moments[-1].subgoal == TASK
    session.set_task(OTHER)
    decide(session, 1)
    assert session.moments[-1].subgoal == OTHER


@pytest.mark.parametrize("agent", ["readout", "bayes", "flat", "idle"])
def test_every_agent_can_be_watched_and_the_module_listens(trial, agent):
    session = Session(replace(trial, agent=agent), TASK)
    decide(session, 2)
    moment = session.moments[-1]
    assert moment.reading.latent.mean.shape == (2,)
    assert moment.reading.probabilities == pytest.approx({"goal": 1.0})
    assert (moment.subgoal is None) == (agent == "flat")


def test_a_push_changes_the_velocity(fresh):
    def moved(push: float) -> float:
        fresh.restart()
        fresh.push(push)
        fresh.step()
        return fresh.x

    assert moved(0.5) - moved(0.0) == pytest.approx(0.5 * fresh.body.step_s, rel=0.35)


def test_a_restart_forgets_all_but_the_task(fresh):
    fresh.set_task(OTHER)
    decide(fresh, 3)
    before = [moment.reward for moment in fresh.moments]
    fresh.restart()
    assert (fresh.time_s, fresh.x, len(fresh.moments)) == (0.0, 0.0, 0)
    decide(fresh, 3)
    assert [moment.reward for moment in fresh.moments] == before
    assert fresh.task == OTHER


def test_a_task_that_the_module_does_not_know_is_refused_and_the_old_one_stays(session):
    session.set_task(TASK)
    with pytest.raises(RebodyError, match="cannot infer 'velocity'"):
        session.set_task(TaskSpec("velocity", (1.0,)))
    assert session.task == TASK


def test_targets_end_where_the_module_or_the_robot_ends(trial):
    lean = Family("lean", Quantity("lean", ("x", "pitch"), "m, rad", "lean"), (Box((-4.0, 0.0), (4.0, 1.0)),), 0.5, 0.3)
    goal, velocity = (SHIPPED.named(name) for name in ("goal", "velocity"))
    families = FamilySet((goal.within(interval(-10.0, 10.0)), velocity.within(interval(-4.0, 2.0)), lean))
    contract = replace(trial.inference.contract, families=families)
    trial = replace(trial, inference=replace(trial.inference, contract=contract))
    assert target_range(trial, "goal") == interval(-10.0, 10.0)
    assert target_range(trial, "velocity") == interval(-3.0, 2.0)  # the tracker's reach is +-3 m/s
    assert target_range(trial, "lean") == lean.range
    for task, fits in {
        TaskSpec("velocity", (-3.7,)): TaskSpec("velocity", (-3.0,)),
        TaskSpec("goal", (4.0,)): TaskSpec("goal", (4.0,)),
        TaskSpec("stand", (1.0,)): TaskSpec("goal", (3.0,)),
        TaskSpec("lean", (-5.0, 0.5)): TaskSpec("lean", (-4.0, 0.5)),
    }.items():
        assert fitting(trial, task) == fits
