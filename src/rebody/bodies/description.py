"""Robots from TOML files: one format for the shipped ones and for a user's own."""

import math
import os
import re
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec

from rebody import inputs
from rebody.bodies.model import Space
from rebody.bodies.robot import Fall, Reach, RobotSpec
from rebody.bodies.source import source
from rebody.bodies.walking.joystick import NAVIGATED_M, Joystick
from rebody.bodies.walking.settings import Phase, Term, Walking
from rebody.bodies.walking.trained import TrainedPolicy
from rebody.errors import RebodyError, unknown
from rebody.names import ROBOTS, shipped_robots
from rebody.ranges import Box
from rebody.store.files import TEXT, read_file

MEASURED = ("dead", "drift", "at_once", "rate")
"""What `rebody robot check` tells of a joystick, and training of one that is learned here."""


class _Root(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    x: str | None = None
    z: str | None = None
    pitch: str | None = None
    body: str | None = None
    space: Space = "plane"


class _Fall(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    min_height: float = Fall.min_height
    max_pitch: float = Fall.max_pitch
    min_up: float = Fall.min_up
    lasts_s: float = Fall.lasts_s


class _Phase(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    frequency: float
    offsets: tuple[float, ...] = Phase.offsets
    at_rest: float | None = None


class _Joystick(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    forward: tuple[float, float]
    sideways: tuple[float, float]
    turn: tuple[float, float]
    dead: tuple[float, float, float] | None = None
    drift: tuple[float, float, float] | None = None
    at_once: float | None = None
    rate: float | None = None


class _Policy(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    joystick: _Joystick
    onnx: str | None = None
    artifact: str | None = None
    inputs: tuple[Term, ...] = ()
    imu: str | None = None
    action_scale: float | tuple[float, ...] | None = None
    joints: tuple[str, ...] = ()
    unheard: tuple[str, ...] = ()
    scales: dict[Term, float] = {}
    clip: float | None = None
    action_clip: float | None = None
    history: int = 1
    phase: _Phase | None = None
    stiffness: tuple[float, ...] = ()
    damping: tuple[float, ...] = ()
    feet: tuple[str, ...] = ()
    mirror: tuple[str, ...] = ()


class _Description(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a robot's file says; `RobotSpec` says what it means."""

    mjcf: str
    frame_skip: int
    root: _Root
    fall: _Fall
    reach: dict[str, list[Any]]
    policy: _Policy | None = None
    keyframe: str | None = None
    rest: dict[str, float] = {}
    timestep: float | None = None
    reset_noise: float = 0.01
    smoothing_s: float = 0.0
    goal_ahead: float = math.inf


def load_robot(robot: str) -> RobotSpec:
    """A shipped robot by name, or one's own by the path of its TOML file; RebodyError if it cannot be had."""
    if robot in shipped_robots():
        return _read(ROBOTS / f"{robot}.toml")
    if robot.endswith(".toml") or "/" in robot:
        return _read(Path(robot))
    raise unknown("robot", robot, shipped_robots(), "or the path of a robot's TOML file")


def _read(path: Path) -> RobotSpec:
    """RebodyError if the file is missing, is no TOML, or says something else than a robot's file should."""
    try:
        description = msgspec.convert(tomllib.loads(read_file(path, TEXT).decode("utf-8-sig")), _Description)
    except OSError as error:
        raise RebodyError(f"cannot read the robot's file '{path}': {error.strerror}.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise RebodyError(f"'{path}' is not a TOML file: {error}.") from error
    except msgspec.ValidationError as error:
        raise RebodyError(f"'{path}' does not describe a robot: {error}. See docs/own-robot.md.") from error
    spec = RobotSpec(
        name=path.stem,
        mjcf=source(_with_variables(description.mjcf, path), path.parent),
        walking=description.policy and _walking(description.policy, path),
        frame_skip=description.frame_skip,
        root=_root(description.root, path),
        space=description.root.space,
        keyframe=description.keyframe,
        timestep=description.timestep,
        rest=tuple(description.rest.items()),
        reset_noise=description.reset_noise,
        smoothing_s=description.smoothing_s,
        goal_ahead=_goal_ahead(description),
        fall=Fall(**msgspec.structs.asdict(description.fall)),
        reach=_reach(description.reach, path),
    )
    _check_values(spec, path)
    return spec


def _goal_ahead(description: _Description) -> float:
    """A navigator knows no farther places."""
    return min(description.goal_ahead, math.inf if description.policy is None else NAVIGATED_M)


def _with_variables(said: str, path: Path) -> str:
    """With the values of environment variables, written ${NAME}; RebodyError where one is not set."""
    for name in re.findall(r"\$\{(\w+)\}", said):
        if name not in os.environ:
            raise RebodyError(f"'{path}' names ${{{name}}}, which is not set: export {name}=FOLDER first.")
        said = said.replace(f"${{{name}}}", os.environ[name])
    return said


def _walking(policy: _Policy, path: Path) -> Walking:
    """RebodyError for what cannot be."""
    stick, artifact = policy.joystick, _artifact(policy, path)
    problems = [
        f"{name} must be at least {least}, and finite"
        for name, value, least in (("history", policy.history, 1), ("phase.frequency", _frequency(policy), 0))
        if not least <= value < math.inf
    ]
    ways = (stick.forward, stick.sideways, stick.turn)
    if not all(-math.inf < low <= 0 <= high < math.inf for low, high in ways):
        problems.append("joystick: each way must be [low, high] around 0")
    if not all(0 <= slowest < math.inf for slowest in stick.dead or ()):
        problems.append("joystick.dead must not be negative")
    if stick.at_once is not None and not 1 <= stick.at_once <= len(ways):
        problems.append(f"joystick.at_once must be from 1 to {len(ways)}")
    if stick.rate is not None and not stick.rate > 0:
        problems.append("joystick.rate must be positive")
    if policy.onnx is not None and artifact is not None:
        problems.append("onnx and artifact are two policies: say one")
    if problems:
        raise RebodyError(f"'{path}': [policy] {'; '.join(problems)}.")
    return Walking(
        **msgspec.structs.asdict(policy)
        | {
            "onnx": None if policy.onnx is None else path.parent / _with_variables(policy.onnx, path),
            "artifact": artifact,
            "joystick": _joystick(stick, artifact),
            "scales": tuple(policy.scales.items()),
            "phase": policy.phase and Phase(**msgspec.structs.asdict(policy.phase)),
        }
    )


def _artifact(policy: _Policy, path: Path) -> str | None:
    """A shipped name as it is, a folder from where the description is."""
    if policy.artifact is None or "/" not in policy.artifact:
        return policy.artifact
    return str(path.parent / _with_variables(policy.artifact, path))


def _joystick(said: _Joystick, artifact: str | None) -> Joystick:
    """What it says; where it is silent, what its artifact has measured, if there is one by now."""
    low, high = zip(said.forward, said.sideways, said.turn, strict=True)
    policy = None if artifact is None else TrainedPolicy(artifact)
    measured = policy.settings.joystick if policy and policy.is_there else Joystick(Box(low, high))
    own = {name: value for name in MEASURED if (value := getattr(said, name)) is not None}
    return replace(measured, limits=Box(low, high), **own)


def _frequency(policy: _Policy) -> float:
    return 0.0 if policy.phase is None else policy.phase.frequency


def _root(root: _Root, path: Path) -> tuple[str, str, str] | str:
    joints = (root.x, root.z, root.pitch)
    if root.body is not None and joints == (None, None, None):
        return root.body
    if root.body is None and root.x and root.z and root.pitch and root.space == "plane":
        return root.x, root.z, root.pitch
    raise RebodyError(
        f"'{path}': [root] names either the joints that carry x, z and pitch, or the body that floats freely, which "
        'alone may have space = "free".'
    )


def _reach(said: Mapping[str, Any], path: Path) -> Reach:
    """A pair of ends for each number of a family's target; one pair where there is one."""
    boxes = {}
    for family, ends in said.items():
        pairs = ends if ends and isinstance(ends[0], list) else [ends]
        where = f"'{path}': [reach] {family}"
        low, high = inputs.numbers(pairs, (len(pairs), 2), "pairs of ends", where).T.tolist()
        try:
            boxes[family] = Box(tuple(low), tuple(high))
        except ValueError as error:
            raise RebodyError(f"{where}: {error}.") from None
    if not boxes:
        raise RebodyError(f"'{path}': [reach] names no family, such as velocity = [-1.0, 1.0]. See docs/own-robot.md.")
    return tuple(boxes.items())


def _check_values(spec: RobotSpec, path: Path) -> None:
    problems = []
    if spec.frame_skip < 1:
        problems.append("frame_skip must be at least 1")
    if spec.timestep is not None and not 0 < spec.timestep < math.inf:
        problems.append("timestep must be positive")
    if not all(math.isfinite(position) for _, position in spec.rest):
        problems.append("[rest] positions must be finite")
    if not spec.reset_noise >= 0:
        problems.append("reset_noise must not be negative")
    if not spec.smoothing_s >= 0:
        problems.append("smoothing_s must not be negative")
    if not spec.goal_ahead > 0:
        problems.append("goal_ahead must be positive")
    if not spec.fall.max_pitch > 0 or not spec.fall.lasts_s >= 0 or not spec.fall.min_up < 1:
        problems.append("[fall] max_pitch must be positive, lasts_s not negative, min_up less than 1")
    if problems:
        raise RebodyError(f"'{path}': {'; '.join(problems)}.")
