"""What is believed over a log of a run is what the agent believed in it."""

import csv

import jax
import numpy as np
import pytest

from rebody.agents.build import build_agent
from rebody.agents.parts import load_inference
from rebody.agents.rollout import rollout_on_toy
from rebody.evaluation.logs import believe, read_log, resample, save_beliefs
from rebody.types import Task

DECISIONS = 60


@pytest.fixture(scope="module")
def module():
    return load_inference("goal-velocity")


@pytest.fixture(scope="module", params=[False, True], ids=["as it is", "sharpened"])
def sharpen(request):
    return request.param


@pytest.fixture(scope="module")
def episodes(module, sharpen):
    """A point mass whose task changes half-way."""
    late, families = np.arange(DECISIONS)[:, None] >= DECISIONS // 2, module.contract.families
    family = np.where(late, families.index("velocity"), families.index("goal")).astype(np.int32)
    task = Task(family, np.where(late, -2.0, 5.0).astype(np.float32)[..., None])
    agent = build_agent("reuse", module, horizon=2, sharpen=sharpen)
    episodes = rollout_on_toy(agent, module.toy, task, families)
    return jax.tree.map(lambda leaf: np.asarray(leaf)[:, 0], (episodes.state, episodes.reward, episodes.belief))


@pytest.fixture
def believed(module, sharpen, write):
    """A function: columns -> beliefs over a log that holds them."""

    def believed(**columns):
        fields = module.contract.fields
        return believe(module, resample(read_log(write(**columns), fields), fields), sharpen)

    return believed


def columns_of(episodes):
    """As logged from the start, at x = 0 at rest."""
    state, reward, _ = episodes
    return {
        "time_s": 0.1 * np.arange(DECISIONS + 1),
        "position_m": np.append(0.0, state.x.astype(float)),
        "velocity_m_s": np.append(0.0, state.vx.astype(float)),
        "reward": np.append(0.0, reward.astype(float)),
    }


def assert_as_the_agent(run, module, episodes, sharpen):
    _, _, of_agent = episodes
    family, target = module.believing(sharpen)[1](of_agent)
    np.testing.assert_allclose(
        run.latent, of_agent.mean, atol=(1e-2 if sharpen else 5e-4) * np.abs(of_agent.mean).max()
    )
    np.testing.assert_allclose([reading.target for reading in run.readings], target, atol=0.05 if sharpen else 2e-3)
    assert [reading.family for reading in run.readings] == [module.contract.families[i].name for i in family]
    for each in module.contract.families:
        own = run.believes(each)
        np.testing.assert_allclose(run.targets(each)[own], np.asarray(target)[own], atol=0.05 if sharpen else 2e-3)
        assert np.isnan(run.targets(each)[~own]).all()


def test_of_a_log_with_a_row_per_decision(believed, module, episodes, sharpen):
    run = believed(**columns_of(episodes))
    np.testing.assert_allclose(run.time_s, 0.1 * np.arange(1, DECISIONS + 1), atol=1e-9)
    assert_as_the_agent(run, module, episodes, sharpen)


def test_of_a_finer_log(believed, module, episodes, sharpen):
    """Rows between the decisions: positions along the way, and the reward that the decision is paid."""
    coarse = columns_of(episodes)
    time = 0.02 * np.arange(5 * DECISIONS + 1)
    decision = np.minimum(np.arange(5 * DECISIONS + 1) // 5 + 1, DECISIONS)  # that a moment belongs to
    decision[5::5] -= 1
    fine = {"time_s": time, "position_m": np.interp(time, coarse["time_s"], coarse["position_m"])}
    fine |= {name: coarse[name][decision] for name in ("velocity_m_s", "reward")}
    fine["velocity_m_s"][0] = 0.0
    assert_as_the_agent(believed(**fine), module, episodes, sharpen)


def test_finds_the_tasks_and_when_they_changed(believed, episodes):
    run = believed(**columns_of(episodes))
    assert run.families.names == ("goal", "velocity")
    assert run.believes(run.families.named("goal"))[15:29].all()
    assert run.targets(run.families.named("goal"))[25] == pytest.approx(5.0, abs=0.25)
    conclusion = run.conclusion()
    assert conclusion.startswith("believes at 6.0 s: velocity -")
    since = float(conclusion.split("velocity since ")[1].split()[0])
    assert 3.0 < since < 4.5


def test_the_table_holds_what_was_heard_and_believed(believed, episodes, tmp_path):
    run, (state, reward, _) = believed(**columns_of(episodes)), episodes
    save_beliefs(run, tmp_path / "new" / "belief.csv")
    with (tmp_path / "new" / "belief.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == DECISIONS
    for i in (0, 30, DECISIONS - 1):
        row, reading = rows[i], run.readings[i]
        assert float(row["time_s"]) == pytest.approx(0.1 * (i + 1))
        assert float(row["position_m"]) == pytest.approx(state.x[i], abs=1e-5)
        assert float(row["reward"]) == pytest.approx(reward[i], abs=1e-5)
        assert row["inferred_family"] == reading.family
        assert float(row["inferred_target"]) == pytest.approx(reading.target[0], abs=1e-5)
        assert sum(float(row[f"probability_{name}"]) for name in run.families.names) == pytest.approx(1.0, abs=1e-4)
        assert float(row[f"latent_{run.latent.shape[1]}"]) == pytest.approx(reading.latent.mean[-1], abs=1e-5)
        assert [float(row[f"cluster_{k}"]) for k in reading.responsibilities] == pytest.approx(
            list(reading.responsibilities.values()), abs=1e-5
        )


def test_nothing_is_heard_in_a_gap(module, believed, episodes, sharpen, write):
    """There the belief stays; after it, it goes on with what the agent would have believed without those decisions."""
    columns = columns_of(episodes)
    lost = np.r_[41:50]  # decisions 40 to 49
    damaged = {name: np.delete(values, lost) for name, values in columns.items()}
    fields = module.contract.fields
    run = believe(module, resample(read_log(write(**damaged), fields, skip_bad_rows=True), fields), sharpen)
    belief = module.begin({"x": 0.0, "vx": 0.0}, sharpen)
    for i in range(1, DECISIONS + 1):
        state = {"x": columns["position_m"][i], "vx": columns["velocity_m_s"][i]}
        reading = belief.update(state, None if 41 <= i <= 50 else columns["reward"][i])
    assert all(np.array_equal(mean, run.latent[39]) for mean in run.latent[40:50])
    np.testing.assert_allclose(run.latent[-1], reading.latent.mean, atol=5e-4 * np.abs(run.latent).max())
    whole = believed(**columns)
    np.testing.assert_array_equal(run.latent[:40], whole.latent[:40])
    assert run.readings[-1].family == whole.readings[-1].family == "velocity"


def test_the_table_is_empty_where_nothing_was_heard(module, episodes, write, tmp_path):
    damaged = {name: np.delete(values, np.r_[11:20]) for name, values in columns_of(episodes).items()}
    fields = module.contract.fields
    run = believe(module, resample(read_log(write(**damaged), fields, skip_bad_rows=True), fields))
    save_beliefs(run, tmp_path / "belief.csv")
    with (tmp_path / "belief.csv").open() as file:
        rows = list(csv.DictReader(file))
    for row, is_heard in ((rows[9], True), (rows[10], False), (rows[19], False), (rows[20], True)):
        assert all((row[name] != "") == is_heard for name in ("position_m", "velocity_m_s", "reward"))
        assert row["inferred_family"]
