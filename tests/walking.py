"""Small robots that walk (or roll) by ONNX policies of our own, and those that ship."""

from pathlib import Path

import numpy as np
import pytest

from rebody.bodies import RobotSpec, load_robot
from rebody.bodies.source import is_there

CART = """
<mujoco model="cart">
  <option timestep="0.005" integrator="implicitfast"/>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1" friction="1 0.005 0.0001"/>
    <body name="chassis" pos="0 0 0.1">
      <freejoint/>
      <site name="imu" pos="0.05 0.02 0.03" quat="0.924 0 0 0.383"/>
      <geom type="box" size="0.15 0.1 0.03" mass="4"/>
      <geom type="sphere" pos="0.13 0 -0.06" size="0.04" mass="0.2" friction="0.001" priority="1"/>
      <geom type="sphere" pos="-0.13 0 -0.06" size="0.04" mass="0.2" friction="0.001" priority="1"/>
      <body name="left" pos="0 0.13 0">
        <joint name="left" type="hinge" axis="0 1 0" damping="0.01"/>
        <geom type="cylinder" size="0.1 0.02" euler="90 0 0" mass="0.5"/>
      </body>
      <body name="right" pos="0 -0.13 0">
        <joint name="right" type="hinge" axis="0 1 0" damping="0.01"/>
        <geom type="cylinder" size="0.1 0.02" euler="90 0 0" mass="0.5"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <velocity name="left" joint="left" kv="2" ctrlrange="-30 30"/>
    <velocity name="right" joint="right" kv="2" ctrlrange="-30 30"/>
  </actuator>
  <sensor>
    <velocimeter site="imu"/>
    <gyro site="imu"/>
  </sensor>
</mujoco>
"""
RADIUS, HALF_TRACK = 0.1, 0.13
CART_TOML = """
mjcf = "cart.xml"
frame_skip = 4
reset_noise = 0.0

[root]
body = "chassis"
space = "free"

[fall]
min_up = 0.5

[policy]
onnx = "cart.onnx"
inputs = ["command"]

[policy.joystick]
forward = [-0.8, 1.0]
sideways = [0.0, 0.0]
turn = [-1.5, 1.5]

[reach]
place = [[-15.0, 15.0], [-15.0, 15.0]]
velocity_xy = [[-1.0, 1.0], [-1.0, 1.0]]
heading = [-3.1416, 3.1416]
"""


def write_linear(path: Path, weights, *, metadata=None, batch=1, memory=0) -> Path:
    """An ONNX policy: actions = observations @ weights, and, with a memory, plus it; each step adds 1 to that."""
    import onnx
    from onnx import TensorProto, helper

    weights = np.asarray(weights, np.float32)
    rows, columns = weights.shape
    say = helper.make_tensor_value_info
    inputs, outputs = (
        [say("obs", TensorProto.FLOAT, [batch, rows])],
        [say("actions", TensorProto.FLOAT, [batch, columns])],
    )
    nodes = [helper.make_node("MatMul", ["obs", "weights"], ["product"])]
    tensors = [helper.make_tensor("weights", TensorProto.FLOAT, weights.shape, weights.ravel())]
    if memory:
        inputs.append(say("h_in", TensorProto.FLOAT, [1, columns]))
        outputs.append(say("h_out", TensorProto.FLOAT, [1, columns]))
        tensors.append(helper.make_tensor("one", TensorProto.FLOAT, [1], [float(memory)]))
        nodes += [
            helper.make_node("Add", ["product", "h_in"], ["actions"]),
            helper.make_node("Add", ["h_in", "one"], ["h_out"]),
        ]
    else:
        nodes.append(helper.make_node("Identity", ["product"], ["actions"]))
    model = helper.make_model(
        helper.make_graph(nodes, "policy", inputs, outputs, tensors), opset_imports=[helper.make_opsetid("", 17)]
    )
    model.ir_version = 9
    helper.set_model_props(model, metadata or {})
    onnx.save(model, str(path))
    return path


def write_cart(folder: Path, toml: str = CART_TOML) -> Path:
    """A cart with two wheels that follows a joystick; the path of its description."""
    (folder / "cart.xml").write_text(CART)
    (folder / "cart.toml").write_text(toml)
    wheels = np.array([[1.0, 1.0], [0.0, 0.0], [-HALF_TRACK, HALF_TRACK]]) / RADIUS
    write_linear(folder / "cart.onnx", wheels)
    return folder / "cart.toml"


def robot_that_is_there(name: str) -> RobotSpec:
    """A shipped robot; a test is skipped where the package that has its model is not installed."""
    spec = load_robot(name)
    if not is_there(spec.mjcf):
        pytest.skip(f"the model of '{name}' comes with the extra robots")
    return spec
