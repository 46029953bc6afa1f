"""A robot's model as MuJoCo compiles it, and questions about its tree of bodies."""

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from rebody.bodies.missing import leave_out_missing
from rebody.errors import RebodyError, did_you_mean
from rebody.store.files import TEXT, check_file

PLANE_JOINTS = ("rebody-x", "rebody-z", "rebody-pitch")
"""Joints of a root body that is held to the plane."""

NOT_USED = (ValueError, RuntimeError, MemoryError, mujoco.FatalError)
"""What MuJoCo raises where a model is malformed, its files are missing, or it asks for more memory than there is."""

Space = Literal["plane", "free"]
"""Where a body that floats freely may go: it is held to the plane of x and z, or left as it is."""


@dataclass(frozen=True)
class Compiled:
    """A model that can be simulated."""

    model: mujoco.MjModel
    keyframe: Float[np.ndarray, " nq"] | None
    """Joint positions of the keyframe that was asked for; of a root that is held to the plane its height alone."""
    left_out: tuple[str, ...]
    """Files that were not there, and that nothing but the picture needs."""


def compile_model(
    robot: str,
    mjcf: Path,
    root: tuple[str, str, str] | str,
    space: Space,
    timestep: float | None,
    keyframe: str | None = None,
) -> Compiled:
    """The model of an MJCF, its root held to the plane, with a time step [s] of its own or the one given.

    RebodyError with MuJoCo's own words where it cannot be had.
    """
    try:
        check_file(mjcf, TEXT)
        spec = mujoco.MjSpec.from_file(str(mjcf))
    except OSError as error:
        raise RebodyError(f"robot '{robot}': MuJoCo cannot read '{mjcf}': {error.strerror}.") from error
    except NOT_USED as error:
        raise RebodyError(f"robot '{robot}': MuJoCo cannot read '{mjcf}': {error}") from error
    if timestep is not None:
        spec.option.timestep = timestep
    key = None if keyframe is None else _key(spec, keyframe, robot)
    held = root if space == "plane" and isinstance(root, str) else None
    if isinstance(root, str):
        joint = _free_joint(spec, root, robot)
        if held:
            _hold_to_plane(spec, held, joint)
    try:
        model, left_out = _compile(spec, robot)
    except NOT_USED as error:
        raise RebodyError(f"robot '{robot}': MuJoCo cannot use '{mjcf}': {error}") from error
    has = model.nq + (4 if held else 0)
    if key is not None and len(key) != has:
        says = f"keyframe '{keyframe}' has {len(key)} joint positions, and its model {has}"
        raise RebodyError(f"robot '{robot}': {says}.")
    return Compiled(model, _held(key, model, held) if key is not None and held else key, left_out)


def _compile(spec: mujoco.MjSpec, robot: str) -> tuple[mujoco.MjModel, tuple[str, ...]]:
    """Without files that are missing, where that is why it fails; their names."""
    with warnings.catch_warnings():
        # what MuJoCo advises instead of the cheetah's `settotalmass` changes the last bits of its physics
        warnings.filterwarnings("ignore", message="compiler attribute 'settotalmass'")
        try:
            return spec.compile(), ()
        except NOT_USED:
            if not (left_out := leave_out_missing(spec, robot)):
                raise
            return spec.compile(), left_out


def _key(spec: mujoco.MjSpec, name: str, robot: str) -> Float[np.ndarray, " nq"]:
    """Joint positions of a keyframe."""
    keys = {key.name: np.array(key.qpos) for key in spec.keys}
    if name not in keys:
        says = f"those are {', '.join(map(repr, keys))}" if keys else "it has none"
        raise RebodyError(f"robot '{robot}': its model has no keyframe '{name}'; {says}.{did_you_mean(name, keys)}")
    if not keys[name].size:
        raise RebodyError(f"robot '{robot}': keyframe '{name}' says nothing of joint positions (qpos).")
    return keys[name]


def _held(key: Float[np.ndarray, " nq"], model: mujoco.MjModel, root: str) -> Float[np.ndarray, " held"]:
    """A keyframe of the floating body, for the one that is held: of its root the height."""
    first, height = int(model.joint(PLANE_JOINTS[0]).qposadr[0]), model.body(root).pos[2]
    return np.concatenate([key[:first], [0.0, key[first + 2] - height, 0.0], key[first + 7 :]])


def _free_joint(spec: mujoco.MjSpec, body_name: str, robot: str) -> mujoco.MjsJoint:
    body = spec.body(body_name)
    free = [joint for joint in body.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE] if body else []
    if not free:
        raise RebodyError(f"robot '{robot}': its model has no body '{body_name}' that floats freely (a free joint).")
    return free[0]


def _hold_to_plane(spec: mujoco.MjSpec, body_name: str, joint: mujoco.MjsJoint) -> None:
    """Replace a body's free joint by slides along x and z and a hinge about y."""
    body = spec.body(body_name)
    spec.delete(joint)
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    axes = ((slide, [1, 0, 0]), (slide, [0, 0, 1]), (hinge, [0, 1, 0]))
    for name, (kind, axis) in zip(PLANE_JOINTS, axes, strict=True):
        joint = body.add_joint(name=name, type=kind, axis=axis, limited=False, armature=0)
        joint.damping[:], joint.stiffness[:], joint.frictionloss = 0, 0, 0  # whatever the model's defaults say
    for key in list(spec.keys):  # they have a number more than the joints now
        spec.delete(key)


def carried_by(model: mujoco.MjModel, body: int) -> Bool[np.ndarray, " body"]:
    """Which bodies move with this one: itself and all below it."""
    carried = np.arange(model.nbody) == body
    for below in range(body + 1, model.nbody):  # parents come first
        carried[below] |= carried[model.body_parentid[below]]
    return carried
