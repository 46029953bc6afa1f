"""What can be said of a robot's description before it moves."""

from dataclasses import dataclass

import mujoco
import numpy as np

from rebody.bodies.model import carried_by
from rebody.bodies.robot import RobotSpec
from rebody.errors import RebodyError

TURNED = 1.0
"""Pitch at which x and z must still be what they were [rad]."""
ALIGNED = 0.99
"""Cosine of the largest angle between an axis and where it should point."""
TOLERANCE = 1e-6
"""Of a rest position that is an end of its joint's range [m, rad]."""


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at."""

    subject: str
    is_right: bool
    says: str


def check_model(spec: RobotSpec) -> list[Finding]:
    """All that is found without a step; where it cannot move, the rest is left out.

    RebodyError if the model cannot be loaded, or the description names a joint of the rest pose that it does not have.
    """
    findings = [*_left_out(spec), _control_step(spec), *(_free(spec) if spec.floats_freely else _root(spec))]
    if not all(finding.is_right for finding in findings):
        return findings  # the others would fail for the same reasons
    whole = [] if spec.floats_freely else [_moves_whole(spec)]
    return [*findings, *whole, _actuators(spec), _rest_pose(spec)]


def _left_out(spec: RobotSpec) -> list[Finding]:
    files = spec.compiled.left_out
    says = f"left out of the picture, since they are not there: {', '.join(files)}"
    return [Finding("files", True, says)] if files else []


def _free(spec: RobotSpec) -> list[Finding]:
    """A free joint moves a body whole."""
    return [Finding("root body", True, f"'{spec.root}', floats freely in space")]


def _control_step(spec: RobotSpec) -> Finding:
    try:
        steps = spec.steps_per_decision
    except RebodyError as error:
        return Finding("control step", False, str(error))
    timestep = spec.model.opt.timestep
    says = f"{spec.frame_skip} x {timestep:g} s = {spec.control_dt:g} s, {steps} to a decision"
    return Finding("control step", True, says)


def _root(spec: RobotSpec) -> list[Finding]:
    """The observation mapping: which joints carry x, z and pitch. Joints along three axes are three joints."""
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    wanted = (("x", slide, 0, "slide along x"), ("z", slide, 2, "slide along z"), ("pitch", hinge, 1, "hinge about y"))
    model, rest = spec.model, mujoco.MjData(spec.model)
    names = [model.joint(i).name for i in range(model.njnt)]
    mujoco.mj_kinematics(model, rest)  # axes in the world: a body may be turned in its model
    turned = _turned(spec) if set(spec.root_joints) <= set(names) else rest
    findings = []
    for joint, (field, kind, axis, what) in zip(spec.root_joints, wanted, strict=True):
        if joint not in names:
            says = f"the model has no joint '{joint}'; its joints are {', '.join(filter(None, names))}"
            findings.append(Finding(field, False, says))
            continue
        found, says = model.joint(joint), f"joint '{joint}'"
        is_right = bool(found.type[0] == kind and rest.xaxis[found.id][axis] > ALIGNED)
        if not is_right:
            says += f" is no {what}"
        elif turned.xaxis[found.id][axis] <= ALIGNED:
            is_right, says = False, f"{says} is no {what} once pitch has turned it: put the hinge last"
        findings.append(Finding(field, is_right, says))
    return findings


def _turned(spec: RobotSpec) -> mujoco.MjData:
    """The rest pose of the model, pitched."""
    data = mujoco.MjData(spec.model)
    data.qpos[spec.root_addresses[2]] += TURNED
    mujoco.mj_kinematics(spec.model, data)
    return data


def _moves_whole(spec: RobotSpec) -> Finding:
    """The three joints move one body, and all of the robot with it: a hip is a hinge about y, too."""
    model, (x, z, pitch) = spec.model, spec.root_joints
    body = model.body(spec.root_body).name or f"number {spec.root_body}"
    moved = [carried_by(model, int(model.joint(name).bodyid[0])) for name in (x, z)]
    for name, carried in zip((x, z), moved, strict=True):
        if not carried[spec.root_body]:
            return Finding("root body", False, f"joint '{name}' does not move body '{body}', which '{pitch}' turns")
    left = (moved[0] | moved[1])[model.geom_bodyid] & ~carried_by(model, spec.root_body)[model.geom_bodyid]
    if left.any():
        others = sorted({model.body(b).name or f"number {b}" for b in model.geom_bodyid[left]})
        says = f"joint '{pitch}' turns body '{body}' and leaves {', '.join(others)}: pitch is that of the whole robot"
        return Finding("root body", False, says)
    return Finding("root body", True, f"'{body}', moved by all three")


def _actuators(spec: RobotSpec) -> Finding:
    model = spec.model
    unlimited = [model.actuator(i).name or str(i) for i in range(model.nu) if not model.actuator_ctrllimited[i]]
    if model.nu == 0:
        return Finding("actuators", False, "the model has none")
    if unlimited:
        return Finding("actuators", False, f"no ctrlrange: {', '.join(unlimited)}; actions in [-1, 1] are scaled to it")
    return Finding("actuators", True, f"{model.nu}, each with a control range")


def _rest_pose(spec: RobotSpec) -> Finding:
    lies = bool(spec.lies(spec.rest_qpos[None])[0])
    height = f"torso {spec.torso_height:.3g} m above the floor"
    faults = [f"{height}: counts as fallen, see [fall]"] * lies + _outside(spec)
    return Finding("rest pose", not faults, "; ".join(faults) or height)


def _outside(spec: RobotSpec) -> list[str]:
    """Joints that the model itself would push into their ranges as soon as it moves."""
    model, faults = spec.model, []
    scalar = (model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE) | (model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE)
    for i in np.flatnonzero(scalar & model.jnt_limited.astype(bool)):
        position, (low, high) = spec.rest_qpos[model.jnt_qposadr[i]], model.jnt_range[i]
        if not low - TOLERANCE <= position <= high + TOLERANCE:
            name = model.joint(i).name or f"number {i}"
            faults.append(f"'{name}' begins at {position:.3g}, out of its range {low:.3g} to {high:.3g}: see [rest]")
    return faults
