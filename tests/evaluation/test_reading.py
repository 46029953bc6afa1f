"""Results come back from their JSON as they were, and what is none is told apart."""

import json
from dataclasses import replace

import pytest

from rebody.errors import RebodyError
from rebody.evaluation import Results, read_results, save_results
from rebody.evaluation.reading import holds_results
from rebody.ranges import Box
from rebody.tasks import SHIPPED, FamilySet, Payment, Quantity
from rebody.tasks.line import GOAL

VECTORS = ("target", "active_target", "inferred_target", "subgoal")


@pytest.fixture
def results(result):
    switched = result(switch={"at_s": 1.0, "family": "goal", "target": [3.0]}, subgoal=[None] * 30, oracle_return=None)
    return Results(
        "cheetah", "reuse", "tiny", None, 0.05, "predicted", 15, True, {"module": "12ab"}, SHIPPED, [result(), switched]
    )


@pytest.fixture
def path(results, tmp_path):
    save_results(results, tmp_path / "out.json")
    return tmp_path / "out.json"


def test_what_was_saved_comes_back(results, path):
    again = read_results(path)
    assert again == results
    assert again.summary == results.summary


def test_how_tasks_were_paid_comes_back(results, path, tmp_path):
    law = Payment("power", True, 3.0, 1.0, exponent=1.5, delay_s=0.3)
    save_results(replace(results, law=law), tmp_path / "paid.json")
    assert read_results(tmp_path / "paid.json").law == law
    _spoil(path, lambda content: content.pop("law"))  # a file of an earlier release
    assert read_results(path) == results


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
        (lambda c: c.update(law={"form": "cubic"}), "'cubic' is unknown"),
        (lambda c: c.update(episodes=[]), "there is no episode"),
        (lambda c: c.update(episodes=[7]), "Expected `object`, got `int`"),
        (lambda c: c["episodes"][0].pop("return"), "return_"),
        (lambda c: c["episodes"][1]["reward"].pop(), "episode of 30 decisions has a 'reward' of 29"),
        (lambda c: c["episodes"][1]["quantities"].pop("x"), "with the family 'goal' lacks its quantity"),
        (lambda c: c["episodes"][1]["quantities"]["x"].pop(), "episode of 30 decisions has a 'x' of 29"),
        (lambda c: c["episodes"][1].update(active_target=[[1.0, 2.0]] * 30), "a target of 'goal' has 1 numbers"),
        (lambda c: c["episodes"][1].update(inferred_target=[[]] * 30), "a target of 'goal' has 1 numbers"),
        (lambda c: c["episodes"][1].update(active_target=[2.0] * 30), "active_target"),
        (lambda c: c["episodes"][1]["quantities"].update(x=[[1.0, 2.0]] * 30), "family 'goal' lacks its quantity"),
        (lambda c: c.update(families=[]), "families: there must be at least one"),
        (lambda c: c["families"].pop(0), "unknown family 'goal'"),
        (lambda c: c["families"].append(c["families"][0]), "none twice"),
        (lambda c: c["families"][0].update(floor=0.0), r"families\[0\].floor"),
        (lambda c: c["families"][0].update(law="absolute"), "law: 'absolute' is not known"),
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


def test_results_say_what_their_families_were(result, tmp_path):
    """Those of a user's own, too, and with the ranges that they had."""
    place = replace(
        GOAL, name="place", quantity=Quantity("xy", ("x", "y"), "m", "place"), targets=(Box((-6.0, -4.0), (6.0, 4.0)),),
        directions=(),
    )  # fmt: skip
    families, vectors = FamilySet((place, GOAL)), [[1.0, -2.0]] * 30
    episode = result(
        families=families, family="place", target=[1.0, -2.0], active_family=["place"] * 30, active_target=vectors,
        inferred_family=["place"] * 29 + ["goal"], inferred_target=[*vectors[:29], [3.0]], subgoal=vectors,
        subgoal_family=["place"] * 30, quantities={"xy": vectors, "x": [1.0] * 30},
    )  # fmt: skip
    results = Results("cheetah", "reuse", "tiny", None, 0.05, 1, 15, False, {}, families, [episode])
    save_results(results, tmp_path / "own.json")
    again = read_results(tmp_path / "own.json")
    assert again == results
    assert again.summary["families"]["place"]["base_task_right"]["value"] == 0.0  # read wrongly at the end
    assert again.episodes[0].missed() == pytest.approx([0.0] * 30, abs=1e-5)


def test_files_that_do_not_say_had_the_families_that_ship(results, path):
    _spoil(path, lambda content: content.pop("families"))
    assert read_results(path) == results


def numbers(value):
    """Vectors of one as numbers."""
    if isinstance(value, list) and value and not isinstance(value[0], float):
        return [each and each[0] for each in value]
    return value[0]


def test_version_1_is_read(results, path):
    """It had numbers in place of vectors, and four quantities by names of their own."""

    def make_old(content):
        content["version"] = 1
        del content["families"]
        for episode, result in zip(content["episodes"], results.episodes, strict=True):
            quantities = episode.pop("quantities")
            old = {"x": "position_m", "vx": "velocity_m_s", "pitch": "pitch_rad", "vz": "vz_max_m_s"}
            episode.update({name: quantities[field] for field, name in old.items()})
            episode.update({name: numbers(getattr(result, name)) for name in VECTORS})
            if result.switch is not None:
                episode["switch"]["target"] = numbers(result.switch["target"])
            del episode["idle_return"]

    _spoil(path, make_old)
    again = read_results(path)
    assert again.episodes == [replace(episode, idle_return=None) for episode in results.episodes]
    assert again.summary["share"] is None
