"""Is a robot's description fit for use? Loads it, runs it, and says what is missing."""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float

from rebody.bodies.robot import RobotBatch, RobotSpec
from rebody.errors import RebodyError

SECONDS = 5.0
"""How long it is run."""
FAR = 1e3
"""Nothing gets farther than this in that time, in m or rad, but a simulation that is about to diverge."""


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at."""

    subject: str
    is_right: bool
    says: str


def check_robot(spec: RobotSpec) -> list[Finding]:
    """All that was found; RebodyError if the model cannot even be loaded."""
    findings = [_control_rate(spec), *_root(spec)]
    if not all(finding.is_right for finding in findings):
        return findings  # running it would fail for the same reasons
    findings += [_actuators(spec), _rest_pose(spec)]
    return [*findings, _run(spec, "does nothing", 0.0), _run(spec, "moves at random", 1.0), _forward(spec)]


def _control_rate(spec: RobotSpec) -> Finding:
    model = spec.model
    try:
        steps = spec.steps_per_decision
    except RebodyError as error:
        return Finding("control step", False, str(error))
    says = f"{spec.frame_skip} x {model.opt.timestep:g} s = {spec.control_dt:g} s, {steps} to a decision"
    return Finding("control step", True, says)


def _root(spec: RobotSpec) -> list[Finding]:
    """The observation mapping: which joints carry x, z and pitch."""
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    wanted = (("x", slide, 0, "slide along x"), ("z", slide, 2, "slide along z"), ("pitch", hinge, 1, "hinge about y"))
    names = [spec.model.joint(i).name for i in range(spec.model.njnt)]
    data = mujoco.MjData(spec.model)
    mujoco.mj_forward(spec.model, data)  # axes in the world: a body may be turned in its model
    findings = []
    for joint, (field, kind, axis, what) in zip(spec.root_joints, wanted, strict=True):
        if joint not in names:
            says = f"the model has no joint '{joint}'; its joints are {', '.join(names)}"
            findings.append(Finding(field, False, says))
            continue
        found = spec.model.joint(joint)
        is_right = found.type[0] == kind and data.xaxis[found.id][axis] > 0.99
        findings.append(Finding(field, bool(is_right), f"joint '{joint}'" + ("" if is_right else f" is no {what}")))
    return findings


def _actuators(spec: RobotSpec) -> Finding:
    model = spec.model
    unlimited = [model.actuator(i).name or str(i) for i in range(model.nu) if not model.actuator_ctrllimited[i]]
    if model.nu == 0:
        return Finding("actuators", False, "the model has none")
    if unlimited:
        return Finding("actuators", False, f"no ctrlrange: {', '.join(unlimited)}; actions in [-1, 1] are scaled to it")
    return Finding("actuators", True, f"{model.nu}, each with a control range")


def _rest_pose(spec: RobotSpec) -> Finding:
    lies = bool(spec.lies(spec.model.qpos0[None])[0])
    height = f"torso {spec.torso_height:.3g} m above the floor"
    return Finding("rest pose", not lies, f"{height}: counts as fallen, see [fall]" if lies else height)


def _run(spec: RobotSpec, what: str, amplitude: float) -> Finding:
    rng, batch = np.random.default_rng(0), RobotBatch(spec, 8, threads=1)
    batch.reset(rng)
    steps, fell_at = round(SECONDS / spec.control_dt), None
    for step in range(steps):
        try:
            batch.step(rng.uniform(-amplitude, amplitude, (batch.size, spec.model.nu)))
        except RebodyError as error:
            return Finding(what, False, str(error))
        if fell_at is None and batch.fallen.any():
            fell_at = (step + 1) * spec.control_dt
    is_sound = _is_sound(batch.qpos)
    fall = "no copy fell" if fell_at is None else f"first of {batch.size} copies fallen after {fell_at:.2g} s"
    return Finding(what, is_sound, f"{SECONDS:g} s, {fall}" if is_sound else "positions run away: lower the time step")


def _forward(spec: RobotSpec) -> Finding:
    """A push forward shows in the global state as it should."""
    batch = RobotBatch(spec, 1, threads=1)
    batch.reset(np.random.default_rng(0))
    before = batch.qpos.copy()
    batch.push(np.ones(1))
    try:
        for _ in range(spec.steps_per_decision):
            batch.step(np.zeros((1, spec.model.nu)))
    except RebodyError as error:
        return Finding("readout", False, str(error))
    speed = float(spec.observe(batch.qpos, before).vx[0])
    return Finding("readout", speed > 0, f"pushed by 1 m/s, it reads {speed:.2f} m/s over the first decision")


def _is_sound(qpos: Float[np.ndarray, "robot nq"]) -> bool:
    return bool(np.isfinite(qpos).all() and np.abs(qpos).max() < FAR)
