"""Task files say which entry is wrong, and a switch takes effect at its moment."""

import json

import numpy as np
import pytest
from tests.tasks.conftest import PLACE

from rebody.errors import RebodyError
from rebody.tasks import SHIPPED, FamilySet
from rebody.tasks.task_file import Switch, TaskSpec, active_tasks, parse_task, read_tasks

GOOD = {"family": "goal", "target": -9.0}
FAMILIES = SHIPPED.only(("goal", "velocity")).beside(FamilySet((PLACE,)))


@pytest.fixture
def file_of(tmp_path):
    """A function content -> path of a file that holds it: text as it is, all else as JSON."""

    def write(content):
        path = tmp_path / "tasks.json"
        path.write_text(content if isinstance(content, str) else json.dumps(content))
        return path

    return write


def test_a_good_file(file_of):
    switched = {"family": "velocity", "target": 1, "switch": {"at_s": 8, "family": "goal", "target": 4.5}}
    first, second = read_tasks(file_of([GOOD, switched]), FAMILIES)
    assert first == TaskSpec("goal", (-9.0,))
    assert first.last == first
    assert second == TaskSpec("velocity", (1.0,), Switch(8.0, "goal", (4.5,)))
    assert second.last == TaskSpec("goal", (4.5,))


def switch(**changes):
    return {**GOOD, "switch": {"at_s": 1.0, **GOOD, **changes}}


def without(entry, key):
    return {name: value for name, value in entry.items() if name != key}


MALFORMED = [
    (3, "Expected `object`, got `int`"),
    (["goal", 3], "Expected `object`, got `array`"),
    (None, "Expected `object`, got `null`"),
    (without(GOOD, "family"), "missing required field `family`"),
    (without(GOOD, "target"), "missing required field `target`"),
    (GOOD | {"targt": 1}, "targt: it is unknown"),
    (GOOD | {"family": "gaol"}, "unknown family 'gaol'. Did you mean 'goal'"),
    (GOOD | {"family": 2}, "family: Expected `str`, got `int`"),
    (GOOD | {"target": "far"}, "target: Expected `array`, got `str`"),
    (GOOD | {"target": True}, "target: Expected `array`, got `bool`"),
    (GOOD | {"target": None}, "target: Expected `array`, got `null`"),
    (GOOD | {"target": float("nan")}, r"target\[0\]: Expected `float`"),
    (GOOD | {"target": float("inf")}, r"target\[0\]: Expected `float` <= 1000000"),
    (GOOD | {"target": 10**400}, r"target\[0\]: "),
    (GOOD | {"target": -1e39}, r"target\[0\]: Expected `float` >= -1000000"),
    (GOOD | {"target": []}, r"a target of 'goal' has 1 numbers \(x\), not 0"),
    (GOOD | {"target": [1.0, 2.0]}, r"a target of 'goal' has 1 numbers \(x\), not 2"),
    (GOOD | {"family": "place"}, r"a target of 'place' has 2 numbers \(x, y\), not 1"),
    (GOOD | {"family": "place", "target": [1.0, "far"]}, r"target\[1\]: Expected `float`, got `str`"),
    (GOOD | {"family": "place", "target": [1.0, float("nan")]}, r"target\[1\]: Expected `float`"),
    (GOOD | {"switch": 3}, "switch: Expected `object"),
    (GOOD | {"switch": GOOD}, "switch: .*missing required field `at_s`"),
    (switch(when=1), "switch.when: it is unknown"),
    (switch(family="fly"), "unknown family 'fly'"),
    (switch(target=[]), "a target of 'goal' has 1 numbers"),
    (switch(at_s="soon"), "switch.at_s: Expected `float`, got `str`"),
    (switch(at_s=-1.0), "switch.at_s: Expected `float` >= 0"),
]


@pytest.mark.parametrize(("entry", "said"), MALFORMED)
def test_a_malformed_entry_is_named(file_of, entry, said):
    with pytest.raises(RebodyError, match=rf"tasks\.json, task 1.*{said}"):
        read_tasks(file_of([GOOD, entry]), FAMILIES)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("[{", "is not a JSON file"),
        ("", "is not a JSON file"),
        ("[" * 100_000, "is not a JSON file"),
        ("9" * 10_000, "is not a JSON file"),
        ([], "at least one task"),
        (GOOD, "must hold a list"),
        ([GOOD] * 20_001, "20,001 tasks; at most 20,000"),
    ],
)
def test_a_file_that_is_no_list_of_tasks(file_of, content, said):
    with pytest.raises(RebodyError, match=said):
        read_tasks(file_of(content), FAMILIES)


def test_a_file_that_cannot_be_read(tmp_path):
    with pytest.raises(RebodyError, match="there is no task file"):
        read_tasks(tmp_path / "none.json", FAMILIES)
    with pytest.raises(RebodyError, match="is a folder"):
        read_tasks(tmp_path, FAMILIES)
    (tmp_path / "bytes").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(RebodyError, match="is not a JSON file"):
        read_tasks(tmp_path / "bytes", FAMILIES)


def test_parse_task():
    assert parse_task("goal=-9", FAMILIES) == TaskSpec("goal", (-9.0,))
    assert parse_task("velocity=1.5", FAMILIES) == TaskSpec("velocity", (1.5,))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("goal", "write FAMILY=TARGET"),
        ("goal=", "write FAMILY=TARGET"),
        ("goal=far", "write FAMILY=TARGET"),
        ("goal=nan", "the target is nan; give a finite number"),
        ("goal=1_0", "write FAMILY=TARGET"),
        ("gaol=3", "Did you mean 'goal'"),
        ("=3", "unknown family"),
        ("place=3", r"has 2 numbers \(x, y\), not 1"),
        ("goal=3,4", "has 1 numbers"),
    ],
)
def test_parse_task_refuses(text, said):
    with pytest.raises(RebodyError, match=f"'{text}'.*{said}"):
        parse_task(text, FAMILIES)


def test_vectors_are_lists_in_a_file_and_comma_separated_on_the_command_line(file_of):
    """And what is written of them reads as it was."""
    place = {"family": "place", "target": [3, -2.5], "switch": {"at_s": 1, "family": "goal", "target": [4.0]}}
    (spec,) = read_tasks(file_of([place]), FAMILIES)
    assert spec == TaskSpec("place", (3.0, -2.5), Switch(1.0, "goal", (4.0,)))
    assert read_tasks(file_of([spec.to_json()]), FAMILIES) == [spec]
    assert spec.to_json()["switch"]["target"] == 4.0
    assert spec.families == ("place", "goal")
    assert parse_task("place=3,-2.5", FAMILIES) == TaskSpec("place", (3.0, -2.5))


def test_active_tasks_change_at_the_switch():
    specs = [
        TaskSpec("goal", (2.0,)),
        TaskSpec("velocity", (1.0,), Switch(0.3, "goal", (-4.0,))),
        TaskSpec("goal", (1.0,), Switch(0.2, "place", (3.0, -2.0))),
    ]
    tasks = active_tasks(specs, FAMILIES, 5, 0.1)
    np.testing.assert_array_equal(tasks.family.T, [[0] * 5, [1] * 3 + [0] * 2, [0] * 2 + [2] * 3])
    np.testing.assert_array_equal(tasks.target[:, 0], [[2.0, 0.0]] * 5)
    np.testing.assert_array_equal(tasks.target[:, 1], [[1.0, 0.0]] * 3 + [[-4.0, 0.0]] * 2)
    np.testing.assert_array_equal(tasks.target[:, 2], [[1.0, 0.0]] * 2 + [[3.0, -2.0]] * 3)
