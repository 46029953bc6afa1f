"""What is drawn of a robot whose meshes are not there."""

import mujoco
import numpy as np
import pytest

from rebody.bodies.shown import shown, top_of

MODEL = """
<mujoco><worldbody>
  <geom name="floor" type="plane" size="1 1 1" group="4"/>
  <body name="trunk" pos="0 0 1"><freejoint/>
    <geom name="trunk hull" size="0.1" group="3" rgba="0 1 0 0.3"/>
    <body name="head" pos="0 0 0.5">
      <geom name="face" size="0.1"/><geom name="head hull" size="0.2" group="3" mass="0"/>
    </body>
  </body>
</worldbody></mujoco>
"""


@pytest.fixture(scope="module")
def model():
    return mujoco.MjModel.from_xml_string(MODEL)


def test_a_body_without_anything_to_see_shows_what_it_collides_with(model):
    drawn, has_gaps = shown(model, 1)
    assert has_gaps
    assert {name: int(drawn.geom(name).group[0]) for name in ("floor", "trunk hull", "face", "head hull")} == {
        "floor": 4, "trunk hull": 0, "face": 0, "head hull": 3,
    }  # fmt: skip
    np.testing.assert_allclose(drawn.geom("trunk hull").rgba, [0, 1, 0, 1])
    assert model.geom("trunk hull").group == 3  # the model itself stays as it is


def test_a_robot_that_can_be_seen_is_left_alone(model):
    assert not shown(model, 2)[1]


def test_how_high_a_robot_reaches(model):
    assert top_of(model, 1) == pytest.approx(1.7)
