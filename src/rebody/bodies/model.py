"""A robot's model as MuJoCo compiles it, and questions about its tree of bodies."""

import warnings
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Bool

from rebody.errors import RebodyError
from rebody.store.files import TEXT, check_file

PLANE_JOINTS = ("rebody-x", "rebody-z", "rebody-pitch")
"""Joints of a root body that is held to the plane."""

NOT_USED = (ValueError, RuntimeError, MemoryError, mujoco.FatalError)
"""What MuJoCo raises where a model is malformed, its files are missing, or it asks for more memory than there is."""


def compile_model(robot: str, mjcf: Path, root: tuple[str, str, str] | str, timestep: float | None) -> mujoco.MjModel:
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
    if isinstance(root, str):
        _hold_to_plane(spec, root, robot)
    with warnings.catch_warnings():
        # what MuJoCo advises instead of the cheetah's `settotalmass` changes the last bits of its physics
        warnings.filterwarnings("ignore", message="compiler attribute 'settotalmass'")
        try:
            return spec.compile()
        except NOT_USED as error:
            raise RebodyError(f"robot '{robot}': MuJoCo cannot use '{mjcf}': {error}") from error


def _hold_to_plane(spec: mujoco.MjSpec, body_name: str, robot: str) -> None:
    """Replace a body's free joint by slides along x and z and a hinge about y."""
    body = spec.body(body_name)
    free = [joint for joint in body.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE] if body else []
    if not free:
        raise RebodyError(f"robot '{robot}': its model has no body '{body_name}' that floats freely (a free joint).")
    spec.delete(free[0])
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
