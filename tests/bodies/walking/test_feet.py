"""The lowest points of what a robot stands on."""

import numpy as np
import pytest

from rebody.bodies import load_robot
from rebody.bodies.walking.batch import JointBatch

STANDING = """
<mujoco>
  <option timestep="0.01"/>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1"/>
    <body name="trunk" pos="0 0 2">
      <freejoint/>
      <geom name="ball" type="sphere" size="0.1" pos="1 0 0"/>
      <geom name="shin" type="capsule" size="0.1 0.4" euler="0 60 0"/>
      <geom name="sole" type="box" size="0.3 0.1 0.02" euler="0 30 0" pos="-1 0 0"/>
      <geom name="stump" type="cylinder" size="0.3 0.4" pos="-2 0 0"/>
      <body name="arm"><joint name="arm"/><geom size="0.05"/></body>
    </body>
  </worldbody>
  <actuator><position name="arm" joint="arm" kp="1" ctrlrange="-1 1"/></actuator>
</mujoco>
"""
TOML = """
mjcf = "standing.xml"
frame_skip = 2
reset_noise = 0.0
[root]
body = "trunk"
space = "free"
[fall]
min_up = 0.5
[policy]
inputs = ["command"]
feet = ["ball", "shin", "sole", "stump"]
[policy.joystick]
forward = [-1.0, 1.0]
sideways = [0.0, 0.0]
turn = [0.0, 0.0]
[reach]
velocity_xy = [[-1.0, 1.0], [-1.0, 1.0]]
"""


def test_feet_are_where_their_lowest_points_are(tmp_path):
    (tmp_path / "standing.xml").write_text(STANDING)
    (tmp_path / "standing.toml").write_text(TOML)
    batch = JointBatch(load_robot(str(tmp_path / "standing.toml")), 2, threads=1)
    batch.reset(np.random.default_rng(0))
    batch.step(np.zeros((2, 1)))
    below = batch.qpos[:, 2, None] - batch.feet[..., 2]
    around = np.hypot(0.3, 0.4)  # nothing better is known of a cylinder
    expected = [0.1, 0.4 * np.cos(np.pi / 3) + 0.1, 0.3 * np.sin(np.pi / 6) + 0.02 * np.cos(np.pi / 6), around]
    assert below == pytest.approx(np.tile(expected, (2, 1)), abs=1e-2)
    assert batch.feet[0, :, 0] == pytest.approx([1.0, 0.0, -1.0, -2.0], abs=1e-2)
