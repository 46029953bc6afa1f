"""A policy of our own, exported as rsl_rl and mjlab export, comes back through [policy] and acts the same."""

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import pytest
from tests.walking import CART_TOML, write_cart

from rebody.bodies import load_robot
from rebody.bodies.walking.policy import WalkingPolicy

onnx = pytest.importorskip("onnx")
ROBOTS, STEPS, HIDDEN, WIDE, DT = 2, 6, 5, 7, 0.02
JOINTS = ("right", "left")
MJLAB = {
    "run_path": "somebody/velocity/1",
    "joint_names": "right,left",
    "default_joint_pos": "0.100,-0.200",
    "joint_stiffness": "20.000,30.000",
    "joint_damping": "1.000,2.000",
    "command_names": "twist",
    "observation_names": "base_lin_vel,base_ang_vel,projected_gravity,joint_pos,joint_vel,actions,command",
    "observation_terms_scale": "2.000,0.250;0.250;0.500,1.000,1.000,0.050,1.000,1.000",
    "observation_terms_flatten_history_dim": "True,True,True,True,True,True,True",
    "observation_terms_history_length": "3,3,3,3,3,3,3",
    "observation_terms_clip": ",".join(["-inf;inf"] * 7),
    "action_scale": "0.500,0.250",
}
"""As mjlab writes them."""
FROM_FILE = ""
DESCRIBED = """
inputs = ["height", "phase_sine", "last_action", "joint_velocities", "command_turn", "linear_velocity", "phase_cosine",
          "gravity", "command_linear", "joint_positions", "angular_velocity", "phase", "command"]
joints = ["right", "left"]
action_scale = [0.5, 0.25]
history = 3
clip = 0.6
action_clip = 0.3
scales = { linear_velocity = 2.0, angular_velocity = 0.25, joint_velocities = 0.05 }
phase = { frequency = 1.25 }
"""
"""Every word there is."""


@dataclass
class Own:
    """An LSTM of one layer behind a normaliser, and a layer behind it, in NumPy."""

    weights: dict[str, np.ndarray]
    h: np.ndarray
    c: np.ndarray

    @classmethod
    def draw(cls, observations):
        rng = np.random.default_rng(0)
        shapes = {
            "mean": (observations,), "std": (observations,), "w": (4 * HIDDEN, observations), "r": (4 * HIDDEN, HIDDEN),
            "b": (8 * HIDDEN,), "w1": (HIDDEN, WIDE), "b1": (WIDE,), "w2": (WIDE, 2), "b2": (2,),
        }  # fmt: skip
        weights = {name: rng.normal(0.0, 0.5, shape).astype(np.float32) for name, shape in shapes.items()}
        weights["std"] = np.abs(weights["std"]) + np.float32(0.5)
        return cls(weights, np.zeros((ROBOTS, HIDDEN)), np.zeros((ROBOTS, HIDDEN)))

    def act(self, seen):
        """One step; gates in ONNX's order: input, output, forget, cell."""
        of = {name: value.astype(float) for name, value in self.weights.items()}
        x = (seen - of["mean"]) / of["std"]
        gates = x @ of["w"].T + self.h @ of["r"].T + of["b"][: 4 * HIDDEN] + of["b"][4 * HIDDEN :]
        gate_in, gate_out, forget = (1 / (1 + np.exp(-each)) for each in np.split(gates, 4, axis=1)[:3])
        self.c = forget * self.c + gate_in * np.tanh(gates[:, 3 * HIDDEN :])
        self.h = gate_out * np.tanh(self.c)
        layer = self.h @ of["w1"] + of["b1"]
        return np.where(layer > 0, layer, np.expm1(layer)) @ of["w2"] + of["b2"]

    def export(self, path: Path, metadata) -> None:
        """rsl_rl's layout: obs [1, n], h_in and c_in [layer, 1, hidden] -> actions, h_out, c_out."""
        helper, numpy, number = onnx.helper, onnx.numpy_helper, onnx.TensorProto.FLOAT
        say, node = helper.make_tensor_value_info, helper.make_node
        of_directions = {name: self.weights[name][None] for name in ("w", "r", "b")}
        tensors = self.weights | of_directions | {"first": np.array([0])}
        memory, nodes = [1, 1, HIDDEN], [
            node("Sub", ["obs", "mean"], ["centred"]),
            node("Div", ["centred", "std"], ["normal"]),
            node("Unsqueeze", ["normal", "first"], ["x"]),
            node("LSTM", ["x", "w", "r", "b", "", "h_in", "c_in"], ["y", "h_out", "c_out"], hidden_size=HIDDEN),
            node("Squeeze", ["h_out", "first"], ["hidden"]),
            node("Gemm", ["hidden", "w1", "b1"], ["wide"]),
            node("Elu", ["wide"], ["active"]),
            node("Gemm", ["active", "w2", "b2"], ["actions"]),
        ]  # fmt: skip
        graph = helper.make_graph(
            nodes, "policy",
            [say("obs", number, [1, len(self.weights["mean"])]), *(say(n, number, memory) for n in ("h_in", "c_in"))],
            [say("actions", number, [1, 2]), *(say(n, number, memory) for n in ("h_out", "c_out"))],
            [numpy.from_array(value, name) for name, value in tensors.items()],
        )  # fmt: skip
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)])
        model.ir_version = 9
        helper.set_model_props(model, metadata)
        onnx.save(model, str(path))


def heard(model, qpos, qvel, command, last_action, step, centre):
    """What each word means, by MuJoCo's own sensors."""
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = qpos, qvel
    mujoco.mj_forward(model, data)
    velocimeter, gyro = np.split(data.sensordata, 2)
    phases = np.array([0.0, np.pi]) + 2 * np.pi * 1.25 * DT * step
    return {
        "linear_velocity": velocimeter,
        "angular_velocity": gyro,
        "gravity": data.site("imu").xmat.reshape(3, 3).T @ [0.0, 0.0, -1.0],
        "command": command,
        "command_linear": command[:2],
        "command_turn": command[2:],
        "joint_positions": [data.joint(name).qpos[0] - rest for name, rest in zip(JOINTS, centre, strict=True)],
        "joint_velocities": [data.joint(name).qvel[0] for name in JOINTS],
        "last_action": last_action,
        "phase": [*np.cos(phases), *np.sin(phases)],
        "phase_cosine": np.cos(phases),
        "phase_sine": np.sin(phases),
        "height": [qpos[2]],
    }


CASES = {
    "what the file says": (
        FROM_FILE,
        MJLAB,
        ("linear_velocity", "angular_velocity", "gravity", "joint_positions", "joint_velocities", "last_action",
         "command"),
        {"linear_velocity": 2.0, "angular_velocity": np.array([0.25, 0.25, 0.5]), "joint_velocities": 0.05},
        (np.inf, np.inf),
        np.array([0.1, -0.2]),
    ),
    "what the description says": (
        DESCRIBED,
        {},
        ("height", "phase_sine", "last_action", "joint_velocities", "command_turn", "linear_velocity", "phase_cosine",
         "gravity", "command_linear", "joint_positions", "angular_velocity", "phase", "command"),
        {"linear_velocity": 2.0, "angular_velocity": 0.25, "joint_velocities": 0.05},
        (0.6, 0.3),
        np.zeros(2),
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_it_acts_as_it_did(tmp_path, case):
    described, metadata, terms, scales, (clip, action_clip), centre = CASES[case]
    path = write_cart(tmp_path, CART_TOML.replace('inputs = ["command"]', f'imu = "imu"{described}'))
    spec, rng = load_robot(str(path)), np.random.default_rng(1)
    still = heard(spec.model, spec.rest_qpos, np.zeros(spec.model.nv), np.zeros(3), np.zeros(2), 0, centre)
    sizes = [len(still[term]) for term in terms]
    own = Own.draw(3 * sum(sizes))
    own.export(tmp_path / "cart.onnx", metadata)
    policy = WalkingPolicy(spec.name, spec.walking, spec.model, spec.rest_qpos, spec.root_body)
    gait, action = policy.begin(ROBOTS), np.zeros((ROBOTS, 2))
    shown = np.zeros((ROBOTS, 3, sum(sizes)))
    for step in range(STEPS):
        qpos, qvel = rng.normal(size=(ROBOTS, spec.model.nq)), rng.normal(size=(ROBOTS, spec.model.nv))
        qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
        command = rng.uniform(-1, 1, (ROBOTS, 3))
        for robot in range(ROBOTS):
            words = heard(spec.model, qpos[robot], qvel[robot], command[robot], action[robot], step, centre)
            newest = np.concatenate([np.multiply(scales.get(term, 1.0), words[term]) for term in terms])
            shown[robot] = [*shown[robot, 1:], newest]
        of_terms = np.split(shown, np.cumsum(sizes)[:-1], axis=2)
        seen = np.concatenate([part.reshape(ROBOTS, -1) for part in of_terms], axis=1)
        action = np.clip(own.act(np.clip(seen, -clip, clip)), -action_clip, action_clip)
        targets = policy.step(gait, qpos, qvel, command, DT)
        np.testing.assert_allclose(targets, centre + np.array([0.5, 0.25]) * action, atol=1e-5)
