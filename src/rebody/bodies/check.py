"""Is a robot's description fit for use? Loads it, runs it, and says what is missing.

`rebody robot check` prints all that was found; training refuses a robot of which something is wrong.
"""

from collections.abc import Callable

import mujoco
import numpy as np
from jaxtyping import Float

from rebody.bodies import RobotBatch, simulate
from rebody.bodies.check_model import Finding, check_model
from rebody.bodies.model import NOT_USED, carried_by
from rebody.bodies.robot import RobotSpec
from rebody.bodies.walking.batch import JointBatch, joint_interface
from rebody.bodies.walking.policy import WalkingPolicy, has_policy
from rebody.errors import RebodyError
from rebody.types import GLOBAL_FIELDS

SECONDS = 5.0
"""How long it is run."""
COPIES = 8
FAR = 1e3
"""Nothing gets farther than this in that time, in m or rad, but a simulation that is about to diverge."""

Look = Callable[[RobotSpec], tuple[bool, str]]
"""Looks at one thing of a robot: whether it is right, and what to say of it."""


def check_robot(spec: RobotSpec) -> list[Finding]:
    """All that was found; RebodyError if the model cannot even be loaded."""
    findings = check_model(spec)
    runs: dict[str, Look] = {"does nothing": _does_nothing, "moves at random": _moves_at_random}
    stages = ({} if spec.walking is None else {"policy": _policy}, runs, _IN_USE)
    for looks in stages:
        if not all(finding.is_right for finding in findings):
            return findings  # what comes would fail for the same reasons
        findings += [_finding(subject, look, spec) for subject, look in looks.items()]
    return findings


def require_ready(spec: RobotSpec) -> None:
    """RebodyError that says all that is wrong with a robot, before anything is trained on it."""
    wrong = [f"{finding.subject}: {finding.says}" for finding in check_robot(spec) if not finding.is_right]
    if wrong:
        raise RebodyError(f"robot '{spec.name}' is not ready. " + "; ".join(wrong))


def _finding(subject: str, look: Look, spec: RobotSpec) -> Finding:
    try:
        return Finding(subject, *look(spec))
    except (RebodyError, *NOT_USED) as error:
        return Finding(subject, False, str(error))


def _policy(spec: RobotSpec) -> tuple[bool, str]:
    """Of a robot that follows a joystick, or is to learn it."""
    assert spec.walking is not None
    if not has_policy(spec.walking):
        joints = joint_interface(spec)
        return True, f"yet to be learned: it is to move {len(joints.names)} joints and hear {joints.hears}"
    joints = WalkingPolicy(spec.name, spec.walking, spec.model, spec.rest_qpos, spec.root_body).joints
    return True, f"it moves {len(joints.names)} joints and hears {joints.hears}"


def _does_nothing(spec: RobotSpec) -> tuple[bool, str]:
    return _run(spec, 0.0)


def _moves_at_random(spec: RobotSpec) -> tuple[bool, str]:
    return _run(spec, 1.0)


def _run(spec: RobotSpec, amplitude: float) -> tuple[bool, str]:
    rng, batch = np.random.default_rng(0), _copies(spec, COPIES)
    batch.reset(rng)
    steps, fell_at = round(SECONDS / spec.control_dt), None
    for step in range(steps):
        batch.step(rng.uniform(-amplitude, amplitude, (batch.size, batch.actions)))
        if fell_at is None and batch.fallen.any():
            fell_at = (step + 1) * spec.control_dt
    if not _is_sound(batch.picture_pose()):
        return False, "positions run away: lower the time step"
    fall = "no copy fell" if fell_at is None else f"first of {batch.size} copies fallen after {fell_at:.2g} s"
    return True, f"{SECONDS:g} s, {fall}"


def _copies(spec: RobotSpec, size: int) -> RobotBatch:
    """As the robot is used; moved around its rest pose where a policy is yet to be learned."""
    learns_to_walk = spec.walking is not None and not has_policy(spec.walking)
    return (JointBatch if learns_to_walk else simulate)(spec, size, threads=1)


def _is_sound(qpos: Float[np.ndarray, "robot nq"]) -> bool:
    return bool(np.isfinite(qpos).all() and np.abs(qpos).max() < FAR)


def _floor(spec: RobotSpec) -> tuple[bool, str]:
    """Once it has settled, something of it touches what does not move; a hop must come down in half the time."""
    model, data = spec.model, mujoco.MjData(spec.model)
    data.qpos[:], data.ctrl[:] = spec.rest_qpos, model.actuator_ctrlrange.mean(axis=1)
    steps = round(SECONDS / spec.control_dt)
    for step in range(steps):
        mujoco.mj_step(model, data, spec.frame_skip)
        if step >= steps // 2 and (touched := _touched(spec, data)) is not None:
            return True, f"stands on {touched}"
    return False, f"nothing of it touches a geom of the world after {SECONDS:g} s without action: add a floor"


def _touched(spec: RobotSpec, data: mujoco.MjData) -> str | None:
    """Name of a geom of the world that bears the robot."""
    model, geoms = spec.model, data.contact.geom[data.contact.efc_address >= 0]
    is_robot = carried_by(model, spec.root_body)[model.geom_bodyid]
    is_world = model.body_weldid[model.geom_bodyid] == 0
    for geom, other in (*geoms, *geoms[:, ::-1]):
        if is_robot[geom] and is_world[other]:
            return f"'{model.geom(other).name}'" if model.geom(other).name else "a geom without a name"
    return None


def _pushed(spec: RobotSpec) -> tuple[bool, str]:
    """A push shows in the global state as it should: forward, and sideways where it can move so."""
    ways = {"forward": "vx", "sideways": "vy"}
    speeds = {way: _speed(spec, i, field) for i, (way, field) in enumerate(ways.items()) if field in spec.moving_fields}
    says = ", ".join(f"{way} it reads {speed:.2f} m/s" for way, speed in speeds.items())
    return min(speeds.values()) > 0, f"pushed by 1 m/s {says} over the first decision"


def _speed(spec: RobotSpec, axis: int, field: str) -> float:
    """What a push along an axis reads as [m/s]."""
    batch = _copies(spec, 1)
    batch.reset(np.random.default_rng(0))
    batch.push(np.eye(2)[[axis]])
    for _ in range(spec.steps_per_decision):
        batch.step(np.zeros((1, batch.actions)))
    return float(getattr(batch.observe(), field)[0])


def _trained(spec: RobotSpec) -> tuple[bool, str]:
    """All that training calls: what is read is finite, and a saved state continues to the last bit, as does a reset."""
    rng, batch, twin = np.random.default_rng(0), _copies(spec, COPIES), _copies(spec, COPIES)
    batch.reset(rng)
    actions = rng.uniform(-1, 1, (2, spec.steps_per_decision, COPIES, batch.actions))
    batch.push(rng.uniform(-1, 1, COPIES))
    _act(batch, actions[0])
    twin.state = batch.state
    if not np.array_equal(_act(batch, actions[1]), _act(twin, actions[1])):
        return False, "a state that was saved does not continue as it did: the model keeps some of it elsewhere"
    read = (batch.proprioception(), batch.joint_state(), batch.observe().select(GLOBAL_FIELDS))
    if not all(np.isfinite(numbers).all() for numbers in read):
        return False, "what is read of it is not finite"
    batch.reset(np.random.default_rng(1))
    twin = _copies(spec, COPIES)
    twin.reset(np.random.default_rng(1))
    if not np.array_equal(_act(batch, actions[0]), _act(twin, actions[0])):
        return False, "after a reset it does not move as a new one: the model keeps some of its state"
    return True, f"a tracker sees {spec.tracker_inputs} numbers; saved states continue to the last bit"


def _act(batch: RobotBatch, actions: Float[np.ndarray, "step robot nu"]) -> Float[np.ndarray, "robot state"]:
    """The state after these actions."""
    for action in actions:
        batch.step(action)
    return batch.state


_IN_USE: dict[str, Look] = {"floor": _floor, "readout": _pushed, "training": _trained}
