"""Statistics by hand, with intervals that hold their value and do not change from run to run."""

import numpy as np
import pytest

from rebody.evaluation.statistics import percentile_95, regret, share_of_oracle, with_interval
from rebody.evaluation.summary import summarise

VALUES = np.random.default_rng(0).gamma(1.0, size=40)


@pytest.mark.parametrize("statistic", [np.mean, np.median, percentile_95])
def test_an_interval_holds_its_value_and_is_the_same_again(statistic):
    found = with_interval(VALUES, statistic)
    assert found["value"] == statistic(VALUES)
    assert found["low"] <= found["value"] <= found["high"]
    assert found["low"] < found["high"]
    assert with_interval(VALUES, statistic) == found


def test_the_interval_of_a_mean_is_that_of_the_normal_distribution():
    found = with_interval(VALUES, np.mean)
    half = 1.96 * VALUES.std() / np.sqrt(len(VALUES))
    assert found["low"] == pytest.approx(VALUES.mean() - half, abs=0.25 * half)
    assert found["high"] == pytest.approx(VALUES.mean() + half, abs=0.25 * half)


@pytest.mark.parametrize("values", [[0.7], [2.0, 2.0, 2.0], [True, True]])
def test_an_interval_of_nothing_that_varies_is_a_point(values):
    assert with_interval(values, np.mean) == {"value": values[0], "low": values[0], "high": values[0]}


def test_an_interval_is_over_tasks_not_over_their_starts():
    """Starts that add nothing leave it as wide as one start of each task."""
    tasks = np.repeat(np.arange(40), 5).tolist()
    found = with_interval(np.repeat(VALUES, 5), np.mean, tasks)
    assert found == pytest.approx(with_interval(VALUES, np.mean))
    too_sure = with_interval(np.repeat(VALUES, 5), np.mean)
    assert too_sure["high"] - too_sure["low"] < 0.6 * (found["high"] - found["low"])


def test_the_share_is_0_for_idle_and_1_for_the_oracle():
    rows = np.array([[-3.0, -2.0, -6.0], [-3.0, -2.0, -6.0]])
    assert share_of_oracle(rows) == pytest.approx(0.75)
    assert share_of_oracle(rows[:, [1, 1, 2]]) == 1.0
    assert share_of_oracle(rows[:, [2, 1, 2]]) == 0.0


def test_what_has_no_value_in_a_resample_does_not_count_there():
    """Nothing is to be gained of two of three tasks, as of sparse rewards that not even the oracle earns."""
    nothing = [0.0, 0.0, 0.0]
    found = with_interval(np.array([nothing, [3.0, 4.0, 0.0], [1.0, 4.0, 0.0], nothing]), share_of_oracle)
    assert found["value"] == 0.5
    assert (found["low"], found["high"]) == (0.25, 0.75)


def test_there_is_no_regret_of_nothing(result):
    earned = [result(target=target, oracle_return=oracle) for target, oracle in ((1.0, 2.0), (2.0, -2.0))]
    assert summarise(earned)["regret"] is None
    assert summarise(earned)["share"] is not None


def test_seeds_are_told_apart(result):
    episodes = [result(target=t, seed=seed, final_error=t + seed) for t in (1.0, 2.0, 4.0) for seed in (0, 1)]
    summary = summarise(episodes)
    assert (summary["episodes"], summary["tasks"]) == (6, 3)
    assert summary["families"]["goal"]["median_error_by_seed"] == {"0": 2.0, "1": 3.0}
    assert summary["share"]["value"] == pytest.approx(0.5)  # -3 between -2 and -4


def test_regret_is_of_sums_and_relative_to_the_oracle():
    assert regret(np.array([[-3.0, -2.0], [-6.0, -4.0]])) == pytest.approx(0.5)
    assert regret(np.array([[-1.0, -2.0], [-5.0, -4.0]])) == pytest.approx(0.0)
    assert regret(np.array([[-1.0, -2.0]])) == pytest.approx(-0.5)  # better than the oracle
    assert regret(np.array([[1.0, 2.0]])) == pytest.approx(0.5)


def test_statistics_of_a_family_by_hand(result):
    errors = [0.1, 0.2, 0.25, 0.3, 4.0]
    episodes = [
        result(final_error=error, final_squared_error=error**2, ripple_m_s=10 * error, fell=error > 1)
        for error in errors
    ]
    summary = summarise(episodes)
    goal = {
        name: figure["value"]
        for name, figure in summary["families"]["goal"].items()
        if "value" in (figure if isinstance(figure, dict) else ())
    }
    assert goal == pytest.approx(
        {
            "median_error": 0.25,
            "p95_error": np.percentile(errors, 95),
            "within_tolerance": 0.6,  # 0.25 m counts
            "arrived_s": 1.8,  # 0.1 m more each decision
            "final_mse": np.mean(np.square(errors)),
            "ripple": 2.5,
            "base_task_right": 1.0,
        }
    )
    assert summary["episodes"] == summary["families"]["goal"]["episodes"] == 5
    assert summary["fell"]["value"] == pytest.approx(0.2)
    assert summary["regret"]["value"] == pytest.approx(0.5)


def test_a_body_arrives_when_its_error_is_within_tolerance(result):
    """Three of five are 0.2 m from their goal, 2 m ahead, after the 12th decision; one has been there and left again,
    one never gets there in 3 s.
    """
    late, early, never = ([0.0] * 11 + [1.8] * 19, [0.0] * 4 + [2.0] + [9.0] * 25, [0.0] * 30)
    paths = [late, late, late, early, never]
    episodes = [result(target=2.0, quantities={"x": path, "vx": [0.0] * 30}) for path in paths]
    assert [episode.arrived_s for episode in episodes] == pytest.approx([1.2, 1.2, 1.2, 0.5, 3.0])
    assert summarise(episodes)["families"]["goal"]["arrived_s"]["value"] == pytest.approx(1.2)


def test_episodes_count_for_the_family_they_end_with(result):
    switched = result(family="velocity", active_family=["velocity"] * 10 + ["goal"] * 20)
    other = result(family="velocity", active_family=["velocity"] * 30)
    families = summarise([result(), switched, other])["families"]
    assert {name: of["episodes"] for name, of in families.items()} == {"goal": 2, "velocity": 1}


@pytest.mark.parametrize(
    ("inferred", "right"),
    [(("goal", 2.0), 1), (("goal", 0.1), 1), (("goal", -2.0), 0), (("velocity", 2.0), 0)],
)
def test_a_base_task_is_right_when_family_and_sign_are(result, inferred, right):
    family, target = inferred
    episode = result(inferred_family=["goal"] * 29 + [family], inferred_target=[9.0] * 29 + [target])
    assert summarise([episode])["families"]["goal"]["base_task_right"]["value"] == right


def test_without_an_oracle_there_is_no_regret(result):
    assert summarise([result(), result(oracle_return=None)])["regret"] is None
