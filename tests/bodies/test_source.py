"""Where models come from."""

import mujoco
import pytest

from rebody.bodies import load_robot
from rebody.bodies.source import InMenagerie, InPackage, is_there, source
from rebody.errors import RebodyError

MODEL = """<mujoco><worldbody><body name="trunk"><freejoint/><geom size="0.1"/></body></worldbody></mujoco>"""
MENAGERIE = f"""
from pathlib import Path
class MenagerieError(Exception): pass
class get:
    def __init__(self, name):
        if name != "ball":
            raise MenagerieError(f"Unknown robot {{name!r}}.")
    def xml(self, entry):
        path = Path(__file__).parent / f"{{entry or 'scene'}}.xml"
        path.write_text({MODEL!r})
        return path
"""


@pytest.fixture
def packages(tmp_path, monkeypatch):
    """A folder of packages."""
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def test_a_file_is_beside_the_description(tmp_path):
    assert source("models/own.xml", tmp_path) == tmp_path / "models" / "own.xml"


def test_a_model_may_come_with_a_package(packages):
    where = source("package:many_robots/ball/scene.xml", packages)
    assert where == InPackage("many_robots", "ball/scene.xml")
    assert not is_there(where)
    (packages / "many_robots" / "ball").mkdir(parents=True)
    (packages / "many_robots" / "ball" / "scene.xml").write_text(MODEL)
    assert is_there(where)
    assert mujoco.MjModel.from_xml_path(str(where.path("ball"))).nbody == 2


@pytest.mark.parametrize("name", ["no_such_package", "..", ""])
def test_a_package_that_is_missing_is_said_with_the_extra(tmp_path, name):
    where = source(f"package:{name}/ball.xml", tmp_path)
    assert not is_there(where)
    with pytest.raises(RebodyError, match=r"'ball': .*, which is not installed: pip install 'rebody\[robots"):
        where.path("ball")


def test_a_model_may_come_from_the_menagerie(packages):
    where = source("menagerie:ball/alone", packages)
    assert where == InMenagerie("ball", "alone")
    (packages / "mujoco_menagerie").mkdir()
    (packages / "mujoco_menagerie" / "__init__.py").write_text(MENAGERIE)
    assert where.path("ball").name == "alone.xml"
    assert source("menagerie:ball", packages).path("ball").name == "scene.xml"
    with pytest.raises(RebodyError, match=r"'cube': .*Menagerie.*Unknown robot 'cube'"):
        source("menagerie:cube", packages).path("cube")


def test_a_robot_whose_model_is_missing_is_described_all_the_same(write_own):
    path = write_own([('mjcf = "own.xml"', 'mjcf = "package:no_such_package/own.xml"')])
    spec = load_robot(path)
    assert spec.name == "own"
    with pytest.raises(RebodyError, match="'no_such_package', which is not installed"):
        assert spec.model
