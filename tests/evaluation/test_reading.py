"""Results come back from their JSON as they were, and what is none is told apart."""

import json

import pytest

from rebody.errors import RebodyError
from rebody.evaluation import Results, read_results, save_results
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
        (lambda c: c.update(version=2), "has version 2; this rebody reads version 1"),
        (lambda c: c.update(robot=3), r"\$.robot"),
        (lambda c: c.update(episodes=[]), "there is no episode"),
        (lambda c: c.update(episodes=[7]), "Expected `object`, got `int`"),
        (lambda c: c["episodes"][0].pop("return"), "return_"),
        (lambda c: c["episodes"][1]["reward"].pop(), "episode of 30 decisions has a 'reward' of 29"),
        (lambda c: c["episodes"][1].update(active_family=["gaol"] * 30), "did you mean 'goal'"),
    ],
)
def test_what_was_edited_is_refused(spoil, says, path):
    _spoil(path, spoil)
    with pytest.raises(RebodyError, match=says) as refused:
        read_results(path)
    assert str(path) in str(refused.value)


@pytest.mark.parametrize("content", ["", "[1, 2]", '{"version": 1}', "not JSON"])
def test_other_files_hold_no_results(content, path):
    assert holds_results(path)
    path.write_text(content)
    assert not holds_results(path)
    with pytest.raises(RebodyError, match="rebody evaluate --json"):
        read_results(path)


def test_those_of_another_version_are_results_all_the_same(path):
    _spoil(path, lambda content: content.update(version=2))
    assert holds_results(path)
