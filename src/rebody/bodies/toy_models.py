"""MuJoCo models of the toys: what their arithmetic says, as bodies that can be watched."""

from pathlib import Path

import mujoco

from rebody.bodies.toys import MassDamper, PositionToy, SpaceToy, Toy
from rebody.types import DECISION_DT

_MODELS = Path(__file__).parent / "models"


def toy_model(toy: Toy) -> mujoco.MjModel:
    """A model whose time step is one decision of this toy, with a joint for each of its axes; its controls are the
    toy's action. TypeError for a toy without a model.
    """
    match toy:
        case SpaceToy():
            return space_toy_model(toy)
        case MassDamper():
            return mass_damper_model(toy)
        case PositionToy():
            return position_toy_model(toy)
    raise TypeError(f"no model of {toy!r}")


def mass_damper_model(toy: MassDamper) -> mujoco.MjModel:
    """On a rail along x."""
    spec = mujoco.MjSpec.from_file(str(_MODELS / "mass_damper.xml"))
    spec.geom("mass").mass = toy.mass
    spec.joint("x").damping[0] = toy.damping
    spec.actuator("force").gear[0] = toy.max_force
    return spec.compile()


def space_toy_model(toy: SpaceToy) -> mujoco.MjModel:
    """A box with a nose, without the joints that are held; its lift is for the floor, 0 in the air."""
    if toy.turns_first:
        raise TypeError("a toy that turns first has no model: its forces are along its heading")
    spec = mujoco.MjSpec.from_file(str(_MODELS / "space_toy.xml"))
    spec.option.gravity[2] = -toy.gravity
    body = spec.body("mass")
    body.mass, body.inertia = toy.mass, [toy.inertia] * 3
    for axis in ("x", "y"):
        spec.joint(axis).damping[0], spec.actuator(axis).gear[0] = toy.damping, toy.max_force
    for axis in ("pitch", "yaw"):
        spec.joint(axis).damping[0], spec.actuator(axis).gear[0] = toy.turn_damping, toy.max_torque
    spec.joint("pitch").stiffness[0] = toy.stiffness
    spec.actuator("z").gear[0] = toy.max_lift
    for axis in toy.held:
        spec.delete(spec.actuator(axis))
        spec.delete(spec.joint(axis))
    return spec.compile()


def position_toy_model(toy: PositionToy) -> mujoco.MjModel:
    """A servo on the speed along x."""
    spec = mujoco.MjSpec.from_file(str(_MODELS / "position_toy.xml"))
    step = spec.actuator("step")
    servo_gain = -step.biasprm[2]
    step.gainprm[0] = servo_gain * toy.max_step / DECISION_DT
    return spec.compile()
