"""A whole evaluation on tiny parts, and what is refused before it starts."""

from dataclasses import replace

import numpy as np
import pytest

from rebody.bodies import load_robot
from rebody.errors import RebodyError
from rebody.evaluation import evaluate, save_results
from rebody.evaluation.evaluate import POINT_MASS
from rebody.tasks.task_file import Switch, TaskSpec

SPECS = [TaskSpec("goal", 2.0), TaskSpec("goal", 1.0, Switch(1.2, "goal", -3.0))]
SEEDS = 2


@pytest.fixture(scope="module")
def results(trial):
    return evaluate(trial, SPECS, SEEDS)


def test_every_task_once_per_seed(results):
    ran = [(episode.target, episode.seed) for episode in results.episodes]
    assert ran == [(2.0, 0), (2.0, 1), (1.0, 0), (1.0, 1)]
    assert {len(episode.time_s) for episode in results.episodes} == {30}
    assert (results.robot, results.control_dt, results.tracker, results.horizon) == ("cheetah", 0.05, "tiny-tracker", 5)


def test_a_seed_is_a_start(results):
    pitch = {(episode.target, episode.seed): episode.pitch_rad[0] for episode in results.episodes}
    assert pitch[2.0, 0] == pytest.approx(pitch[1.0, 0], abs=0.02)
    assert abs(pitch[2.0, 0] - pitch[2.0, 1]) > 0.02


def test_the_task_changes_at_its_moment(results):
    """Rewards and what is said to be active agree."""
    for episode in results.episodes[SEEDS:]:
        late = np.array(episode.time_s) > 1.2 + 1e-9
        np.testing.assert_array_equal(episode.active_target, np.where(late, -3.0, 1.0))
        np.testing.assert_allclose(
            episode.reward, -np.abs(np.array(episode.position_m) - episode.active_target), atol=1e-4
        )
        x = np.array(episode.position_m)[-20:]
        assert episode.final_error == pytest.approx(np.abs(x + 3).mean(), abs=1e-4)


def test_returns_are_sums_of_rewards(results):
    for episode in results.episodes:
        assert episode.return_ == pytest.approx(sum(episode.reward), abs=1e-2)


def test_the_oracle_is_told_the_active_task_and_regrets_nothing(trial, results):
    specs = [*SPECS, TaskSpec("velocity", -1.5, Switch(0.5, "goal", 4.0))]
    oracle = evaluate(replace(trial, agent="oracle"), specs, 1)
    for episode in oracle.episodes:
        assert episode.subgoal == episode.active_target
        assert episode.subgoal_family == episode.active_family
        assert episode.oracle_return == pytest.approx(episode.return_, rel=1e-6)
    assert oracle.summary["regret"]["value"] == pytest.approx(0.0, abs=1e-6)
    beside = [episode.oracle_return for episode in results.episodes if episode.seed == 0]
    assert beside == pytest.approx([episode.return_ for episode in oracle.episodes[:2]], rel=1e-3)


def test_the_idle_agent_is_the_same_on_every_task(trial):
    idle = evaluate(replace(trial, agent="idle"), [TaskSpec("goal", 2.0), TaskSpec("goal", -7.0)], 1)
    first, second = idle.episodes
    assert first.position_m == pytest.approx(second.position_m, abs=1e-3)
    assert first.reward != second.reward


REFUSED = {
    "was trained on 'cheetah', not on 'hopper'": lambda trial: (
        replace(trial, robot=replace(load_robot("cheetah"), name="hopper")), SPECS,
    ),
    "'tiny' was trained on goal and cannot infer 'velocity'": lambda trial: (trial, [TaskSpec("velocity", 1.0)]),
    "cannot infer 'velocity'.*rebody list": lambda trial: (
        trial, [TaskSpec("goal", 1.0, Switch(1.0, "velocity", 1.0))],
    ),
    "--seconds 2.9 is too short": lambda trial: (replace(trial, seconds=2.9), SPECS),
    "a switch at 3 s is not within an episode of 3 s": lambda trial: (
        trial, [TaskSpec("goal", 1.0, Switch(3.0, "goal", 2.0))],
    ),
    "unknown agent 'resue'": lambda trial: (replace(trial, agent="resue"), SPECS),
    "its encoder sees x, which 'cheetah' does not have": lambda trial: (
        replace(trial, robot=replace(load_robot("cheetah"), moving_fields=("z",))), SPECS,
    ),
}  # fmt: skip


@pytest.mark.parametrize("said", REFUSED)
def test_what_does_not_fit_is_refused(trial, said):
    with pytest.raises(RebodyError, match=said):
        evaluate(*REFUSED[said](trial), 1)
