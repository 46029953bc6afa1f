"""Results come back from their JSON as they were, and what is none is told apart."""

import json
from dataclasses import replace

import pytest

from rebody.errors import RebodyError
from rebody.evaluation import Results, read_results, save_results
from rebody.evaluation.episode import VECTORS
from rebody.evaluation.reading import holds_results


@pytest.fixture
def results(result):
    switched = result(switch={"at_s": 1.0, "family": "goal", "target": 3.0}, subgoal=[None] * 30, oracle_return=None)
    return Results(
        "cheetah", "reuse", "tiny", None, 0.05, "predicted", 15, True, {"module": "12ab"}, [result(), switched]
    )


@pytest.fixture
def path(results, tmp_path):
    save_results(results, tmp_path / "out.json")
    return tmp_path / "out.json"


def test_what_was_saved_comes_back(results, path):
    again = read_results(path)
    assert again == results
    assert again.summary == results.summary


def _spoil(path, spoil):
    content = json.loads(path.read_text())
    spoil(content)
    path.write_text(json.dumps(content))


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda c: c.pop("episodes"), "holds no results of an evaluation"),
        (lambda c: c.update(version=3), "has version 3; this rebody reads versions 1 to 2"),
        (lambda c: c.update(robot=3), r"\$.robot"),
        (lambda c: c.update(episodes=[]), "there is no episode"),
        (lambda c: c.update(episodes=[7]), "Expected `object`, got `int`"),
        (lambda c: c["episodes"][0].pop("return"), "return_"),
        (lambda c: c["episodes"][1]["reward"].pop(), "episode of 30 decisions has a 'reward' of 29"),
        (lambda c: c["episodes"][1]["quantities"].pop("x"), "with the family 'goal' lacks its quantity"),
        (lambda c: c["episodes"][1]["quantities"]["x"].pop(), "episode of 30 decisions has a 'x' of 29"),
        (lambda c: c["episodes"][1].update(active_target=[[1.0, 2.0]] * 30), "active_target"),
        (lambda c: c["episodes"][1].update(active_family=["gaol"] * 30), "Did you mean 'goal'"),
    ],
)
def test_what_was_edited_is_refused(spoil, says, path):
    _spoil(path, spoil)
    with pytest.raises(RebodyError, match=says) as refused:
        read_results(path)
    assert str(path) in str(refused.value)


@pytest.mark.parametrize("content", ["", "[1, 2]", '{"version": 1}', "not JSON", "[" * 100_000 + "]" * 100_000])
def test_other_files_hold_no_results(content, path):
    assert holds_results(path)
    path.write_text(content)
    assert not holds_results(path)
    with pytest.raises(RebodyError, match="rebody evaluate --json"):
        read_results(path)


def test_those_of_another_version_are_results_all_the_same(path):
    _spoil(path, lambda content: content.update(version=3))
    assert holds_results(path)


def test_version_1_is_read(results, path):
    """It had numbers in place of vectors, and four quantities by names of their own."""

    def make_old(content):
        content["version"] = 1
        for episode, result in zip(content["episodes"], results.episodes, strict=True):
            quantities = episode.pop("quantities")
            old = {"x": "position_m", "vx": "velocity_m_s", "pitch": "pitch_rad", "vz": "vz_max_m_s"}
            episode.update({name: quantities[field] for field, name in old.items()})
            episode.update({name: getattr(result, name) for name in VECTORS})
            del episode["idle_return"]

    _spoil(path, make_old)
    again = read_results(path)
    assert again.episodes == [replace(episode, idle_return=None) for episode in results.episodes]
    assert again.summary["share"] is None
