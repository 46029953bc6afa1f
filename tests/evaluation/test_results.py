"""The JSON: its names, that it is strict, and that it is written whole or not at all."""

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from rebody.agents.rollout import Episodes
from rebody.errors import RebodyError
from rebody.evaluation import Results, save_results, summary_table
from rebody.evaluation.results import episode_results
from rebody.ranges import Box, interval
from rebody.tasks import SHIPPED, FamilySet, Payment, Quantity
from rebody.tasks.line import GOAL as GOALS
from rebody.tasks.task_file import Switch, TaskSpec, active_tasks
from rebody.types import Belief, Subgoal, global_state

HEAD = {
    "version", "robot", "agent", "inference", "decision_dt", "control_dt", "stride", "horizon", "thesis", "frozen",
    "episodes", "families", "summary",
}  # fmt: skip
SERIES = {
    "time_s", "reward", "active_family", "active_target",
    "inferred_family", "inferred_target", "cluster", "latent", "subgoal_family", "subgoal",
}  # fmt: skip
EPISODE = SERIES | {"family", "target", "seed", "quantities", "fell", "return", "oracle_return", "final_error"}
BESIDE_HEAD = {"tracker", "sharpened", "law"}
BESIDE_EPISODE = {"final_squared_error", "ripple_m_s", "idle_return"}
DECISIONS = 40
GOAL, VELOCITY, STAND = (SHIPPED.index(name) for name in ("goal", "velocity", "stand"))


@pytest.fixture
def results(result):
    return Results(
        "cheetah", "reuse", "tiny", "tiny-tracker", 0.05, 1, 15, False, {}, SHIPPED, [result(), result(target=-1.0)]
    )


def read(path):
    """As strict JSON: no NaN, no Infinity."""

    def refuse(constant):
        raise ValueError(constant)

    return json.loads(path.read_text(), parse_constant=refuse)


def test_names_of_the_file(results, tmp_path):
    save_results(results, tmp_path / "new" / "out.json")
    content = read(tmp_path / "new" / "out.json")
    assert content.keys() == HEAD | BESIDE_HEAD
    assert [episode.keys() for episode in content["episodes"]] == [EPISODE | BESIDE_EPISODE] * 2
    assert content["version"] == 2
    assert (content["decision_dt"], content["control_dt"]) == (0.1, 0.05)
    assert content["episodes"][0]["return"] == -3.0
    assert content["episodes"][0]["target"] == [2.0]
    assert content["episodes"][0]["active_target"] == [[2.0]] * 30
    assert content["summary"] == json.loads(json.dumps(results.summary))
    assert os.listdir(tmp_path / "new") == ["out.json"]


def test_a_switch_is_told(results, result, tmp_path):
    switched = result(switch={"at_s": 1.0, "family": "goal", "target": [3.0]})
    save_results(replace(results, episodes=[switched]), tmp_path / "out.json")
    assert read(tmp_path / "out.json")["episodes"][0]["switch"] == switched.switch


def test_what_json_cannot_hold_leaves_the_old_file(results, result, tmp_path):
    path = tmp_path / "out.json"
    path.write_text("old")
    with pytest.raises(ValueError, match="not JSON compliant"):
        save_results(replace(results, episodes=[result(final_error=float("nan"))]), path)
    assert path.read_text() == "old"


def test_a_full_disk_leaves_the_old_file(results, tmp_path, monkeypatch):
    path = tmp_path / "out.json"
    path.write_text("old")
    write = Path.write_text

    def write_half(self, text, **options):
        write(self, text[: len(text) // 2], **options)
        raise OSError("no space left on device")

    monkeypatch.setattr(Path, "write_text", write_half)
    with pytest.raises(RebodyError, match=r"out\.json cannot be written: no space"):
        save_results(results, path)
    assert path.read_text() == "old"
    monkeypatch.undo()
    save_results(results, path)
    assert read(path)["robot"] == "cheetah"


def shown(results):
    with open(os.devnull, "w") as nowhere:
        console = Console(width=200, record=True, file=nowhere)
        console.print(summary_table(results))
        return console.export_text()


def test_the_table_shows_each_family_that_occurs(results):
    text = shown([results, replace(results, agent="oracle")])
    assert "cheetah, reuse" in text
    assert "goal: median error [m]" in text
    assert "100.0 %" in text  # within tolerance
    assert "velocity" not in text


def test_the_table_names_a_law_of_payment(results):
    assert "law" not in shown([results])
    text = shown([replace(results, law=Payment("gaussian", scale=3.0)), results])
    assert "gaussian, scale 3" in text
    assert "each family's own" in text


def test_families_of_one_name_share_a_row(results):
    """Two modules may have learned other ranges of what they call the same."""
    farther = FamilySet((GOALS.within(interval(0.0, 30.0)),))
    assert shown([results, replace(results, family_set=farther)]).count("goal: median error") == 1


@pytest.fixture(scope="module")
def episodes():
    """Two episodes [time, episode]: one that stands at its goal, one that runs at 1.5 m/s."""
    time = 0.1 * np.arange(1, DECISIONS + 1, dtype=np.float32)[:, None]
    x = np.concatenate([np.full_like(time, 4.0), 1.5 * time], axis=-1)
    still = np.zeros_like(x)
    vx = np.broadcast_to(np.array([0.0, 1.5], np.float32), x.shape)
    vz = np.where(time == time[3], 2.0, np.where(time == time[20], -1.0, 0.0)).astype(np.float32) + still
    state = global_state(x=x, pitch=still + 0.3, vx=vx, vz=vz)
    belief = Belief(np.stack([x, -x], axis=-1), np.ones((*x.shape, 2), np.float32))
    return Episodes(
        state, -np.abs(x - 5), belief, Subgoal(np.full(x.shape, GOAL), (x + 1)[..., None]), np.array([False, True])
    )


@pytest.fixture(scope="module")
def judged(episodes):
    specs = [TaskSpec("goal", (5.0,)), TaskSpec("goal", (3.0,), Switch(1.0, "velocity", (2.0,)))]
    tasks = active_tasks(specs, SHIPPED, DECISIONS, 0.1)
    family = np.full(episodes.reward.shape, GOAL, np.int32)
    family[-1] = VELOCITY
    read = (family, np.full((*family.shape, SHIPPED.size), 0.123456789, np.float32))
    cluster = np.arange(2 * DECISIONS).reshape(DECISIONS, 2) // 60
    return episode_results(
        SHIPPED, specs, np.array([0, 3]), tasks, episodes, read, cluster,
        {"oracle": np.array([-7.0, -8.0]), "idle": None},
    )  # fmt: skip


def test_one_entry_per_decision(judged):
    for episode in judged:
        content = episode.to_json()
        assert {len(content[name]) for name in SERIES} == {DECISIONS}
        assert content["time_s"][:3] == [0.1, 0.2, 0.3]
        assert content["time_s"][-1] == 4.0


def test_series_are_those_of_the_episode(judged):
    stands, runs = judged
    assert stands.quantities["x"] == [4.0] * DECISIONS
    assert runs.quantities["x"] == pytest.approx(1.5 * np.array(runs.time_s), abs=1e-5)
    assert runs.quantities["vx"] == [1.5] * DECISIONS
    assert stands.quantities["pitch"] == [0.3] * DECISIONS
    assert stands.latent[0] == [4.0, -4.0]
    assert stands.subgoal == [[5.0]] * DECISIONS
    assert stands.subgoal_family == ["goal"] * DECISIONS
    assert stands.inferred_target[0] == [0.12346]
    assert stands.inferred_family[-2:] == ["goal", "velocity"]
    assert stands.cluster == runs.cluster == [0] * 30 + [1] * 10
    assert [episode.seed for episode in judged] == [0, 3]
    assert [episode.fell for episode in judged] == [False, True]


def test_largest_vz_is_that_of_the_last_second(judged):
    vz = np.array(judged[0].reached_of(SHIPPED.named("jump")))[:, 0]
    np.testing.assert_array_equal(vz[:3], np.zeros(3))
    np.testing.assert_array_equal(vz[3:13], np.full(10, 2.0))  # 2 m/s at the fourth decision
    np.testing.assert_array_equal(vz[13:], np.zeros(DECISIONS - 13))  # -1 m/s is never the largest


def test_returns_and_errors(judged):
    stands, runs = judged
    assert stands.return_ == pytest.approx(-DECISIONS)
    assert (stands.oracle_return, runs.oracle_return) == (-7.0, -8.0)
    assert (stands.final_error, stands.final_squared_error) == pytest.approx((1.0, 1.0))


def test_a_pitch_is_judged_as_such(episodes):
    specs, cluster = [TaskSpec("stand", (1.0,)), TaskSpec("stand", (-0.2,))], np.zeros(episodes.reward.shape, int)
    tasks, read = (
        active_tasks(specs, SHIPPED, DECISIONS, 0.1),
        (np.full(cluster.shape, STAND), episodes.reward[..., None]),
    )
    leans = episode_results(
        SHIPPED, specs, np.arange(2), tasks, episodes, read, cluster, {"oracle": None, "idle": None}
    )
    assert [episode.final_error for episode in leans] == pytest.approx([0.7, 0.5])
    assert [episode.final_squared_error for episode in leans] == pytest.approx([0.49, 0.25])
    assert {*leans[0].inferred_family, *leans[1].active_family} == {"stand"}
    assert leans[0].oracle_return is None


def test_after_a_switch_the_error_is_taken_against_the_last_task(judged):
    runs = judged[1]
    assert (runs.family, runs.target) == ("goal", [3.0])
    assert runs.active_family == ["goal"] * 10 + ["velocity"] * 30
    assert runs.active_target == [[3.0]] * 10 + [[2.0]] * 30
    assert runs.final_error == pytest.approx(0.5, abs=1e-5)
    assert runs.final_squared_error == pytest.approx(0.25, abs=1e-5)
    assert runs.switch == {"at_s": 1.0, "family": "velocity", "target": (2.0,)}


def test_each_family_has_as_many_numbers_as_it_has(episodes):
    """Places of two numbers beside goals of one, whatever the axis of all."""
    quantity = Quantity("x_pitch", ("x", "pitch"), "m, rad", "place and pitch")
    lean = replace(GOALS, name="lean", quantity=quantity, targets=(Box((-5.0, -1.0), (5.0, 1.0)),), directions=())
    families = FamilySet((GOALS, lean))
    specs = [TaskSpec("goal", (5.0,), Switch(1.0, "lean", (4.0, -0.1))), TaskSpec("lean", (3.0, 0.3))]
    tasks, cluster = active_tasks(specs, families, DECISIONS, 0.1), np.zeros(episodes.reward.shape, int)
    wide = replace(episodes, subgoal=Subgoal(tasks.family, tasks.target))
    one, other = episode_results(
        families,
        specs,
        np.arange(2),
        tasks,
        wide,
        (tasks.family, tasks.target),
        cluster,
        {"oracle": None, "idle": None},
    )
    assert one.active_target == [[5.0]] * 10 + [[4.0, -0.1]] * 30
    assert one.subgoal == one.inferred_target == one.active_target
    assert other.quantities["x_pitch"][0] == pytest.approx([0.15, 0.3])
    assert one.quantities["x"] == [4.0] * DECISIONS
    assert one.final_error == pytest.approx(0.4, abs=1e-5)
    assert one.reached.shape == (DECISIONS, 2)
    assert other.final_squared_error == pytest.approx(9.0, abs=1e-4)
    assert one.base_task_right().all()
