"""The artifact that a walking policy's training leaves behind, and its card."""

from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

import numpy as np

from rebody.bodies import RobotSpec
from rebody.bodies.walking.batch import joint_interface
from rebody.bodies.walking.joints import JointInterface
from rebody.bodies.walking.joystick import UNITS, WAYS
from rebody.bodies.walking.measure import WalkingMeasured, measure_walking
from rebody.bodies.walking.trained import KIND, Three, WalkingSettings
from rebody.control.sac import Actor
from rebody.ranges import Box
from rebody.store import save_artifact
from rebody.training.card import card
from rebody.training.run import Run
from rebody.training.walking.config import WalkingConfig
from rebody.training.walking.follower import ActorFollower
from rebody.training.walking.measure import PUSH, PUSH_EVERY_S, SLOW, measure, slow_error, stand, stressed
from rebody.training.walking.scales import network_of


def save_walking(actor: Actor, spec: RobotSpec, config: WalkingConfig, run: Run) -> Path:
    """Measure, write artifact and card."""
    assert spec.walking is not None
    limits = spec.walking.joystick.limits
    ways = measure_walking(spec, lambda size: ActorFollower(spec, size, actor))
    joints = joint_interface(spec)
    settings = _settings(spec, joints, limits, ways, config, run)
    steps, updates = (run.iterations * each for each in (config.steps * config.robots, config.updates))
    what = (
        f"Walking policy of '{spec.name}': (what it feels, joystick command) -> joint targets. Trained on {steps:,} "
        f"control steps with {updates:,} updates."
    )
    rows = _figures(actor, spec, limits, config) | {"lag": f"{ways.lag_s:.2f} s"}
    text = card(f"Walking policy: {spec.name}", what, run, rows)
    weights = network_of(actor, joints)
    return save_artifact(run.out, kind=KIND, config=asdict(settings), weights=weights, card=text, log=run.log)


def _settings(
    spec: RobotSpec, joints: JointInterface, limits: Box, ways: WalkingMeasured, config: WalkingConfig, run: Run
) -> WalkingSettings:
    """All that whoever walks by it has to know."""
    stiffness, damping = joints.gains_in(spec.model)
    return WalkingSettings(
        robot=spec.name,
        control_dt=spec.control_dt,
        inputs=joints.inputs,
        joints=joints.names,
        rest=tuple(joints.rest.tolist()),
        action_scale=tuple(joints.scale.tolist()),
        stiffness=tuple(stiffness),
        damping=tuple(damping),
        low=_three(limits.low),
        high=_three(limits.high),
        dead=_three(0.0 if slowest == np.inf else slowest for slowest in ways.dead),
        drift=_three(ways.drift),
        hidden=config.sac.hidden,
        at_once=ways.at_once,
        rate=None if ways.rate == np.inf else ways.rate,
        training=run.training(config),
    )


def _three(numbers: Iterable[float]) -> Three:
    forward, sideways, turn = (round(float(number), 3) + 0.0 for number in numbers)
    return forward, sideways, turn


def _figures(actor: Actor, spec: RobotSpec, limits: Box, config: WalkingConfig) -> dict[str, str]:
    """Rows of the card."""
    size, seconds = config.final_held_out, config.final_s
    missed = measure(ActorFollower(spec, size, actor), limits, seconds)
    condition = f"{size} held-out commands, {seconds:g} s: median / p95 error"
    rows = {
        f"{way} in [{low:g}, {high:g}] {unit}, {condition}": (
            f"{missed[f'{way} median']:.3f} / {missed[f'{way} p95']:.3f} {unit}"
        )
        for way, unit, low, high in zip(WAYS, UNITS, limits.low, limits.high, strict=True)
    }
    slow, stood = (of(spec, actor, size, seconds) for of in (slow_error, stand))
    fell = stressed(spec, actor, limits, size, 2 * seconds)
    return rows | {
        "fell": f"{100 * missed['fell']:.1f} %",
        f"slow commands, {SLOW[0]:g} to {SLOW[1]:g} m/s in any direction: median error": f"{slow:.3f} m/s",
        f"no command: distance after {seconds:g} s, median": f"{stood:.3f} m",
        f"fell under pushes to {PUSH:g} m/s and new commands every {PUSH_EVERY_S:g} s, {2 * seconds:g} s": (
            f"{100 * fell:.1f} %"
        ),
    }
