"""Which part lost what."""

import io
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from rebody.evaluation.diagnosis import LADDER, Diagnosis, diagnose, diagnoses_among, diagnosis_tables, shares_of
from rebody.evaluation.episode import EpisodeResult
from rebody.evaluation.results import Results
from rebody.ranges import Box
from rebody.report.diagnosis import plot_diagnosis
from rebody.tasks import SHIPPED, FamilySet, Quantity
from rebody.tasks.line import GOAL
from rebody.tasks.task_file import TaskSpec

TIME = 40


def episode_of(family="goal", target=4.0, *, read=None, subgoal=None, reached=None, slot=None, guessed=None, paid=-9.0):
    """An episode that ends where it is told to; whatever is not said is as it should be."""
    read = target if read is None else read
    subgoal = read if subgoal is None else subgoal
    reached = subgoal if reached is None else reached
    x, v = ([reached] * TIME, [0.0] * TIME) if family == "goal" else ([0.0] * TIME, [reached] * TIME)
    return EpisodeResult(
        families=SHIPPED, family=family, target=[target], seed=0, switch=None,
        time_s=(0.1 * np.arange(1, TIME + 1)).tolist(),
        quantities={"x": x, "vx": v, "pitch": [0.0] * TIME, "vz": [0.0] * TIME}, reward=[paid / TIME] * TIME,
        active_family=[family] * TIME, active_target=[[target]] * TIME, inferred_family=[guessed or family] * TIME,
        inferred_target=[[read]] * TIME, cluster=[0] * TIME, latent=[[0.0, 0.0]] * TIME,
        subgoal_family=[slot or family] * TIME, subgoal=[[subgoal]] * TIME, fell=False, return_=paid,
        oracle_return=-5.0, idle_return=None, final_error=abs(reached - target),
        final_squared_error=0.0, ripple_m_s=0.0,
    )  # fmt: skip


def results_of(*episodes, agent="reuse"):
    return Results("cheetah", agent, "tiny", "tiny-tracker", 0.05, 1, 15, False, {}, SHIPPED, list(episodes))


def diagnosis_of(*episodes):
    others = {agent: results_of(*episodes, agent=agent) for agent in LADDER}
    return Diagnosis(others | {"reuse": results_of(*episodes)})


@pytest.mark.parametrize(
    ("episode", "culprit"),
    [
        (episode_of(read=-4.0, subgoal=4.0, reached=9.0), "wrong base task"),
        (episode_of(guessed="velocity", reached=9.0), "wrong base task"),
        (episode_of(slot="velocity", reached=9.0), "wrong slot"),
        (episode_of(read=3.0, subgoal=2.9, reached=2.8), "target read"),
        (episode_of(read=3.9, subgoal=2.9, reached=2.8), "high level"),
        (episode_of("velocity", 2.0, read=1.9, subgoal=1.8, reached=0.5), "tracker"),
    ],
)
def test_the_part_to_blame(episode, culprit):
    assert shares_of(episode).culprit == culprit
    assert diagnosis_of(episode, episode_of()).culprits() == {culprit: 1}


def test_shares_are_distances_along_the_chain():
    shares = shares_of(episode_of(read=3.9, subgoal=3.6, reached=3.5))
    np.testing.assert_allclose([shares.read, shares.high_level, shares.tracker], [0.1, 0.3, 0.1], atol=1e-9)


def test_shares_of_vectors_are_lengths_of_differences():
    """A heading by the shorter way round; a read target of another family is cut, or filled up."""
    dock = replace(
        GOAL, name="dock", quantity=Quantity("x_yaw", ("x", "yaw"), "m, rad", "dock"),
        targets=(Box((-5.0, -3.0), (5.0, 3.0)),), directions=(),
    )  # fmt: skip
    episode = replace(
        episode_of(), families=FamilySet((dock, GOAL)), family="dock", target=[4.0, 3.1],
        active_family=["dock"] * TIME, active_target=[[4.0, 3.1]] * TIME,
        inferred_family=["dock"] * TIME, inferred_target=[[4.0, -3.1]] * TIME,
        subgoal_family=["dock"] * TIME, subgoal=[[3.7, -2.7]] * TIME,
        quantities={"x_yaw": [[3.7, -2.6]] * TIME, "x": [3.7] * TIME},
    )  # fmt: skip
    shares = shares_of(episode)
    expected = [2 * np.pi - 6.2, 0.5, 0.1]
    np.testing.assert_allclose([shares.read, shares.high_level, shares.tracker], expected, atol=1e-5)
    assert shares.base_task_right
    assert shares.slot_right
    misread = replace(episode, inferred_family=["goal"] * TIME, inferred_target=[[4.0]] * TIME)
    assert shares_of(misread).culprit == "wrong base task"
    assert shares_of(misread).read == pytest.approx(3.1)


def test_nobody_is_to_blame_within_tolerance():
    assert not diagnosis_of(episode_of(reached=4.2), episode_of("velocity", 2.0, reached=1.9)).culprits()


def test_what_parts_cost_adds_up_to_the_return():
    paid = dict(zip(LADDER, (-5.0, -6.0, -8.5, -9.0), strict=True))
    diagnosis = Diagnosis({agent: results_of(episode_of(paid=value), agent=agent) for agent, value in paid.items()})
    assert diagnosis.lost() == pytest.approx({"oracle": -5.0, "bayes": -1.0, "readout": -2.5, "reuse": -0.5})


def test_early_slots_do_not_count():
    late = episode_of()
    wrong = replace(late, subgoal_family=["velocity"] * 30 + ["goal"] * (TIME - 30))
    assert diagnosis_of(late, wrong).wrong_slots() == pytest.approx(10 / (2 * (TIME - 20)))


def test_a_base_task_must_be_known_after_twenty_decisions():
    found_at_last = episode_of()
    for right_from, known in ((19, 1.0), (20, 0.5)):  # the first nineteen entries, or twenty, are wrong
        late = replace(found_at_last, inferred_family=["velocity"] * right_from + ["goal"] * (TIME - right_from))
        assert diagnosis_of(found_at_last, late).base_task_known() == known


def test_every_agent_does_the_same_tasks(trial, tmp_path):
    told = []
    diagnosis = diagnose(trial, [TaskSpec("goal", (3.0,)), TaskSpec("goal", (-2.0,))], 1, told.append)
    assert told == list(LADDER)
    assert [results.agent for results in diagnosis.results.values()] == [*told, "idle"]
    assert len({tuple(tuple(e.target) for e in results.episodes) for results in diagnosis.results.values()}) == 1
    console = Console(width=200, record=True, file=io.StringIO())
    for table in diagnosis_tables(diagnosis):
        console.print(table)
    text = console.export_text()
    assert all(what in text for what in (*LADDER.values(), "idle: stands still"))
    assert f"{diagnosis.results['bayes'].summary['families']['goal']['median_error']['value']:.3f}" in text
    plot_diagnosis(diagnosis, tmp_path / "d.png")
    assert (tmp_path / "d.png").stat().st_size > 10_000


def test_evaluations_that_are_there_are_a_diagnosis():
    ladder = [results_of(episode_of(), agent=agent) for agent in ("flat", *reversed(LADDER))]
    elsewhere = replace(results_of(episode_of()), robot="walker")
    whole, half = diagnoses_among([*ladder, elsewhere])
    assert whole.is_complete
    assert set(whole.results) == set(LADDER)
    assert half.results == {"reuse": elsewhere}
    assert not half.is_complete
    assert [len(diagnosis_tables(diagnosis)) for diagnosis in (whole, half)] == [3, 2]


@pytest.mark.parametrize(
    "other",
    [
        results_of(episode_of(target=5.0), agent="oracle"),
        replace(results_of(episode_of(), agent="oracle"), tracker="another"),
        replace(results_of(episode_of(), agent="oracle"), frozen={"module": "another"}),
    ],
)
def test_evaluations_under_other_conditions_are_not_compared(other):
    (diagnosis,) = diagnoses_among([other, results_of(episode_of())])
    assert set(diagnosis.results) == {"reuse"}


def test_there_is_no_diagnosis_of_a_point_mass_or_of_thesis_mode():
    results = results_of(episode_of())
    assert not diagnoses_among([replace(results, robot="point-mass"), replace(results, thesis=True)])
