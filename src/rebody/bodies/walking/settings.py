"""What a robot's description says of the policy that it walks by: the table [policy] of its TOML."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rebody.bodies.walking.joystick import Joystick

Term = Literal[
    "linear_velocity",
    "angular_velocity",
    "gravity",
    "command",
    "command_linear",
    "command_turn",
    "joint_positions",
    "joint_velocities",
    "last_action",
    "phase",
    "phase_cosine",
    "phase_sine",
    "height",
]
"""What a walking policy may hear, in the field's words: velocities of the IMU in its own frame [m/s, rad/s], the
world's (0, 0, -1) in it, the joystick command or its two parts, joints relative to the rest pose [rad, rad/s], its last
action, cosines then sines of the gait's phases or either, and the root's height above the floor [m]."""


@dataclass(frozen=True)
class Phase:
    """A clock that the gait goes by."""

    frequency: float
    """Cycles per second."""
    offsets: tuple[float, ...] = (0.0, 3.141592653589793)
    """Of each leg, at the start [rad]."""
    at_rest: float | None = None
    """What all are shown as while no command is given [rad]; None where the clock goes on."""


@dataclass(frozen=True)
class Walking:
    """A policy that follows a joystick, and what it hears and moves; or the one that such a robot is to learn."""

    onnx: Path | None
    """Its file: one input of observations, one output of actions, and memory `NAME_in`, `NAME_out` where it has any."""
    joystick: Joystick
    artifact: str | None = None
    """One that was learned here, a shipped name or a folder, which says by itself what it hears and moves."""
    inputs: tuple[Term, ...] = ()
    """In their order; none for what the file's own metadata say (mjlab)."""
    imu: str | None = None
    """Site of the root's body whose frame velocities and gravity are in; None for the body's own."""
    action_scale: float | tuple[float, ...] | None = None
    """Radians of an action of 1, for all joints or each; None for what the file's metadata say, else 1."""
    joints: tuple[str, ...] = ()
    """In the policy's order; none for what the metadata say, else the order of the model's actuators."""
    unheard: tuple[str, ...] = ()
    """Joints whose positions and velocities it is shown as 0."""
    scales: tuple[tuple[Term, float], ...] = ()
    """What some inputs are multiplied by."""
    clip: float | None = None
    """Largest observation, either way."""
    action_clip: float | None = None
    """Largest action, either way."""
    history: int = 1
    """Control steps that each input is shown of, the oldest first."""
    phase: Phase | None = None
    stiffness: tuple[float, ...] = ()
    """PD gains of each joint where the model has motors [N m/rad]; none for the model's own actuators."""
    damping: tuple[float, ...] = ()
    """[N m s/rad]"""
    feet: tuple[str, ...] = ()
    """Geoms that it stands on: a policy that is learned here lifts them instead of dragging them."""
    mirror: tuple[str, ...] = ()
    """Where left and right are alike: for each joint the one whose place it takes in a mirror, behind a minus where it
    turns the other way. A policy that is learned here then learns both sides at once."""
