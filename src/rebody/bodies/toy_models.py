"""MuJoCo models of the toys: what their arithmetic says, as bodies that can be watched."""

from pathlib import Path

import mujoco

from rebody.bodies.toys import FullToy, MassDamper, PositionToy, Toy
from rebody.types import DECISION_DT

_MODELS = Path(__file__).parent / "models"


def toy_model(toy: Toy) -> mujoco.MjModel:
    """A model whose time step is one decision of this toy; its joints are x, and of a full toy z and pitch."""
    match toy:
        case FullToy():
            return full_toy_model(toy)
        case MassDamper():
            return mass_damper_model(toy)
        case PositionToy():
            return position_toy_model(toy)
    raise TypeError(f"no model of {toy!r}")


def mass_damper_model(toy: MassDamper) -> mujoco.MjModel:
    """A model whose time step is one decision of this toy; its control is the toy's action."""
    spec = mujoco.MjSpec.from_file(str(_MODELS / "mass_damper.xml"))
    spec.geom("mass").mass = toy.mass
    spec.joint("x").damping[0] = toy.damping
    spec.actuator("force").gear[0] = toy.max_force
    return spec.compile()


def full_toy_model(toy: FullToy) -> mujoco.MjModel:
    """A model whose time step is one decision of this toy; its controls are its action, without lift in the air."""
    spec = mujoco.MjSpec.from_file(str(_MODELS / "full_toy.xml"))
    spec.option.gravity[2] = -toy.gravity
    body = spec.body("mass")
    body.mass, body.inertia = toy.mass, [toy.inertia] * 3
    spec.joint("x").damping[0] = toy.damping
    pitch = spec.joint("pitch")
    pitch.damping[0], pitch.stiffness[0] = toy.turn_damping, toy.stiffness
    for name, gear in (("force", toy.max_force), ("lift", toy.max_lift), ("torque", toy.max_torque)):
        spec.actuator(name).gear[0] = gear
    return spec.compile()


def position_toy_model(toy: PositionToy) -> mujoco.MjModel:
    """A model whose time step is one decision of this toy; its control is the toy's action."""
    spec = mujoco.MjSpec.from_file(str(_MODELS / "position_toy.xml"))
    step = spec.actuator("step")
    servo_gain = -step.biasprm[2]
    step.gainprm[0] = servo_gain * toy.max_step / DECISION_DT
    return spec.compile()
