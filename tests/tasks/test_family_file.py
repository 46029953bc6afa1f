"""Families of a user's own: what is read, and that every bad file gets one clear message."""

import json
from dataclasses import asdict

import numpy as np
import pytest

from rebody.errors import RebodyError
from rebody.ranges import Box
from rebody.store.typed import Misfit, typed
from rebody.tasks import LAWS, SHIPPED, FamilySet
from rebody.tasks.family_file import read_families
from rebody.types import Task, global_state

TOML = """
[[families]]
name = "lean"
quantity = { name = "x_pitch", components = ["x", "pitch"], unit = "m, rad", label = "place and pitch" }
targets = [{ low = [1.0, 0.2], high = [4.0, 0.6] }]
floor = 0.5
tolerance = 0.3
"""
PYTHON = """
from rebody.ranges import Box
from rebody.tasks import Family, Quantity, RewardLaw

LAWS = [RewardLaw("squared", "-error^2", lambda distance, scale: -(distance**2))]


def families():
    place = Quantity("xy", ("x", "y"), "m", "place")
    boxes = (Box((-5.0, -5.0), (5.0, 5.0)),)
    return [
        Family("near", place, boxes, floor=1.0, tolerance=0.3, law="squared"),
        Family("spot", place, boxes, floor=1.0, tolerance=0.3),
    ]
"""


@pytest.fixture(autouse=True)
def _no_laws_are_left():
    before = dict(LAWS)
    yield
    LAWS.clear()
    LAWS.update(before)


@pytest.fixture
def file_of(tmp_path):
    """A function (name, content) -> path of a file that holds it."""

    def write(name, content):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def test_without_a_file_there_are_those_that_ship():
    assert read_families(None) is SHIPPED


def test_a_toml_file(file_of):
    families = read_families(file_of("own.toml", TOML))
    assert families.names == ("lean", *SHIPPED.names)
    lean = families.named("lean")
    assert (lean.quantity.components, lean.targets) == (("x", "pitch"), (Box((1.0, 0.2), (4.0, 0.6)),))
    assert (lean.law, lean.settle, lean.directions, lean.law_source) == ("relative", "last", (), "")
    assert read_families(file_of("mark.toml", b"\xef\xbb\xbf" + TOML.encode())) == families


def test_a_python_file_with_a_law_of_its_own(file_of):
    families = read_families(file_of("own.py", PYTHON))
    assert families.names == ("near", "spot", *SHIPPED.names)
    assert families.named("near").law_source == LAWS["squared"].source != ""
    assert families.named("spot").law_source == ""
    state = global_state(x=np.zeros(2), y=np.zeros(2))
    paid = families.reward(Task(np.array([0, 1]), np.array([[3.0, 4.0], [3.0, 4.0]])), state)
    np.testing.assert_allclose(paid, [-25.0, -1.0], rtol=1e-5)
    assert read_families(file_of("own.py", PYTHON)) == families  # the same file once more


def test_a_law_whose_file_was_changed_is_refused(file_of):
    """In a run that knows the old one, and by an artifact that was made with it."""
    stored = json.loads(json.dumps(asdict(read_families(file_of("own.py", PYTHON)))))
    assert typed(stored, FamilySet).named("near").law == "squared"
    changed = PYTHON.replace("distance**2", "distance**4")
    with pytest.raises(RebodyError, match=r"own\.py': a reward law 'squared' is known already"):
        read_families(file_of("own.py", changed))
    del LAWS["squared"]
    with pytest.raises(Misfit, match="law: 'squared' is not known as it was; name the file that defines it"):
        typed(stored, FamilySet)
    read_families(file_of("own.py", changed))
    with pytest.raises(Misfit, match="law: 'squared' is not known as it was"):
        typed(stored, FamilySet)


def test_a_law_of_the_package_is_not_replaced(file_of):
    with pytest.raises(RebodyError, match="a reward law 'plain' is known already; choose another name"):
        read_families(file_of("own.py", PYTHON.replace("squared", "plain")))


def replaced(old, new, content=TOML):
    assert old in content
    return content.replace(old, new)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "missing required field `families`"),
        ("families = []", "there must be at least one"),
        ("families = 3", "families: Expected `array`"),
        ("[[families", "is not a TOML file"),
        (b"\xff\xfe\x00", "is not a TOML file"),
        ("a = " + "[" * 100_000, "is not a TOML file"),
        (TOML + TOML, "none twice"),
        (replaced("lean", "goal"), "the name 'goal' is taken by a family that ships"),
        (replaced('"lean"', '"le an"'), r"families\[0\].name: "),
        (replaced('"lean"', '"' + "l" * 61 + '"'), r"families\[0\].name: "),
        (replaced('name = "lean"\n', ""), r"families\[0\]: .*missing required field `name`"),
        (replaced("floor = 0.5", "floor = 0.0"), r"families\[0\].floor: Expected `float` > 0"),
        (replaced("floor = 0.5", "floor = nan"), r"families\[0\].floor: "),
        (replaced("floor = 0.5", 'floor = "low"'), r"families\[0\].floor: Expected `float`, got `str`"),
        (replaced("floor = 0.5", "flour = 0.5\nfloor = 0.5"), r"families\[0\].flour: it is unknown"),
        (replaced('"pitch"]', '"colour"]'), "'colour' is unknown; a global state has x, y"),
        (replaced('"pitch"]', '"x"]'), "none twice"),
        (replaced('["x", "pitch"]', "[]"), "there must be at least one"),
        (replaced("low = [1.0, 0.2]", "low = [1.0]"), "low and high must be as many numbers each"),
        (replaced("low = [1.0, 0.2], high = [4.0, 0.6]", "low = [1.0], high = [4.0]"), "'x_pitch' has 2 numbers"),
        (replaced("low = [1.0, 0.2]", "low = [5.0, 0.2]"), "there is nothing"),
        (replaced("low = [1.0, 0.2]", "low = [-inf, 0.2]"), r"targets\[0\].low\[0\]: Expected `float`"),
        (replaced("[{ low = [1.0, 0.2], high = [4.0, 0.6] }]", "[]"), "so must their ends"),
        (TOML + 'law = "squared"', "law: 'squared' is not known as it was"),
        (TOML + 'settle = "first"', r"families\[0\].settle: "),
        (TOML + 'colour = "red"', r"families\[0\].colour: "),
        (TOML + 'directions = [{ name = "up", towards = [1.0] }]', "each must point to 2 numbers"),
        (replaced('label = "place and pitch"', 'label = "p", frame = "robot"'), r"quantity.frame: "),
    ],
)
def test_a_bad_toml_file_is_refused(content, says, file_of):
    refused(file_of("own.toml", content), says)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "KeyError: 'families'"),
        ("def families(:", "SyntaxError"),
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("families = 3", "TypeError: 'int' object is not callable"),
        ("def families():\n    return []", "there must be at least one, and none twice"),
        ("def families():\n    return [3]", "AttributeError|TypeError"),
        ("LAWS = [3]\ndef families():\n    return []", "TypeError"),
        (replaced('"near"', '"goal"', PYTHON), "the name 'goal' is taken by a family that ships"),
        (replaced('"near"', '"spot"', PYTHON), "none twice"),
        (replaced('law="squared"', 'law="cubed"', PYTHON), "law: 'cubed' is not known as it was"),
        (replaced("(5.0, 5.0)", "(5.0, -9.0)", PYTHON), "there is nothing"),
        ("raise SystemExit(3)", "SystemExit"),
    ],
)
def test_a_bad_python_file_is_refused(content, says, file_of):
    refused(file_of("own.py", content), says)


def refused(path, says):
    with pytest.raises(RebodyError, match=says) as error:
        read_families(path)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 600


def test_a_file_that_cannot_be_read(tmp_path):
    with pytest.raises(RebodyError, match=r"cannot read the families' file '.*none\.toml'"):
        read_families(tmp_path / "none.toml")
    with pytest.raises(RebodyError, match="is a folder"):
        read_families(tmp_path)
