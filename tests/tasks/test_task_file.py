"""Task files say which entry is wrong, and a switch takes effect at its moment."""

import json

import numpy as np
import pytest

from rebody.errors import RebodyError
from rebody.tasks import GOAL, VELOCITY
from rebody.tasks.task_file import Switch, TaskSpec, active_tasks, parse_task, read_tasks

GOOD = {"family": "goal", "target": -9.0}


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
    first, second = read_tasks(file_of([GOOD, switched]))
    assert first == TaskSpec("goal", -9.0)
    assert first.last == first
    assert second == TaskSpec("velocity", 1.0, Switch(8.0, "goal", 4.5))
    assert second.last == TaskSpec("goal", 4.5)


def switch(**changes):
    return {**GOOD, "switch": {"at_s": 1.0, **GOOD, **changes}}


def without(entry, key):
    return {name: value for name, value in entry.items() if name != key}


MALFORMED = [
    (3, "expected an object.*got 3"),
    (["goal", 3], "expected an object"),
    (None, "expected an object.*got null"),
    (without(GOOD, "family"), "'family' is missing"),
    (without(GOOD, "target"), "'target' is missing"),
    (GOOD | {"targt": 1}, "unknown key 'targt'; known are family, switch, target"),
    (GOOD | {"family": "gaol"}, "unknown task family 'gaol'. Did you mean 'goal'"),
    (GOOD | {"family": 2}, "the family must be a name, got 2"),
    (GOOD | {"target": "far"}, "the target is 'far'; give a number"),
    (GOOD | {"target": True}, "the target is True; give a number"),
    (GOOD | {"target": None}, "the target is None; give a number"),
    (GOOD | {"target": float("nan")}, "the target is nan; give a finite number"),
    (GOOD | {"target": float("inf")}, "the target is inf; give a finite number"),
    (GOOD | {"target": 10**400}, r"the target is 10+\.\.\.; give a number"),
    (GOOD | {"target": -1e39}, r"the target is -1e\+39; give a number of at most 1e\+06"),
    (GOOD | {"switch": 3}, "switch: expected an object"),
    (GOOD | {"switch": GOOD}, "switch: 'at_s' is missing"),
    (switch(when=1), "switch: unknown key 'when'; known are at_s, family, target"),
    (switch(family="fly"), "switch: unknown task family 'fly'"),
    (switch(target=[]), "switch: the target has shape"),
    (switch(at_s="soon"), "switch: 'at_s' is 'soon'; give a number"),
    (switch(at_s=-1.0), "the switch cannot be before the start"),
]


@pytest.mark.parametrize(("entry", "said"), MALFORMED)
def test_a_malformed_entry_is_named(file_of, entry, said):
    with pytest.raises(RebodyError, match=rf"tasks\.json, task 1.*{said}"):
        read_tasks(file_of([GOOD, entry]))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("[{", "is not a JSON file"),
        ("", "is not a JSON file"),
        ("[" * 100_000, "is not a JSON file"),
        ("9" * 10_000, "is not a JSON file"),
        ([], "at least one task"),
        (GOOD, "must hold a list"),
    ],
)
def test_a_file_that_is_no_list_of_tasks(file_of, content, said):
    with pytest.raises(RebodyError, match=said):
        read_tasks(file_of(content))


def test_a_file_that_cannot_be_read(tmp_path):
    with pytest.raises(RebodyError, match="there is no task file"):
        read_tasks(tmp_path / "none.json")
    with pytest.raises(RebodyError, match="is a folder"):
        read_tasks(tmp_path)
    (tmp_path / "bytes").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(RebodyError, match="is not a JSON file"):
        read_tasks(tmp_path / "bytes")


def test_parse_task():
    assert parse_task("goal=-9") == TaskSpec("goal", -9.0)
    assert parse_task("velocity=1.5") == TaskSpec("velocity", 1.5)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("goal", "write FAMILY=TARGET"),
        ("goal=", "write FAMILY=TARGET"),
        ("goal=far", "write FAMILY=TARGET"),
        ("goal=nan", "the target is nan; give a finite number"),
        ("goal=1_0", "write FAMILY=TARGET"),
        ("gaol=3", "Did you mean 'goal'"),
        ("=3", "unknown task family"),
    ],
)
def test_parse_task_refuses(text, said):
    with pytest.raises(RebodyError, match=f"'{text}'.*{said}"):
        parse_task(text)


def test_active_tasks_change_at_the_switch():
    specs = [TaskSpec("goal", 2.0), TaskSpec("velocity", 1.0, Switch(0.3, "goal", -4.0))]
    tasks = active_tasks(specs, 5, 0.1)
    np.testing.assert_array_equal(tasks.family[:, 0], [GOAL] * 5)
    np.testing.assert_array_equal(tasks.target[:, 0], [2.0] * 5)
    np.testing.assert_array_equal(tasks.family[:, 1], [VELOCITY] * 3 + [GOAL] * 2)
    np.testing.assert_array_equal(tasks.target[:, 1], [1.0] * 3 + [-4.0] * 2)
