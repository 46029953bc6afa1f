"""The artifact that a walking policy's training leaves behind, and its card."""

from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

import numpy as np

from rebody.bodies import RobotSpec
from rebody.bodies.walking.joints import JointInterface
from rebody.bodies.walking.joystick import WAYS
from rebody.bodies.walking.measure import WalkingMeasured, measure_walking
from rebody.bodies.walking.trained import KIND, Three, WalkingSettings
from rebody.control.sac import Actor
from rebody.ranges import Box
from rebody.store import save_artifact
from rebody.training.card import card
from rebody.training.run import Run
from rebody.training.walking import measure
from rebody.training.walking.config import WalkingConfig
from rebody.training.walking.follower import ActorFollower
from rebody.training.walking.scales import network_of

UNITS = ("m/s", "m/s", "rad/s")


def save_walking(actor: Actor, spec: RobotSpec, config: WalkingConfig, run: Run) -> Path:
    """Measure, write artifact and card."""
    assert spec.walking is not None
    limits = spec.walking.joystick.limits
    ways = measure_walking(spec, lambda size: ActorFollower(spec, size, actor))
    joints = ActorFollower(spec, 1, actor).joints
    settings = _settings(spec, joints, limits, ways, config, run)
    steps, updates = (run.iterations * each for each in (config.steps * config.robots, config.updates))
    what = (
        f"Walking policy of '{spec.name}': (what it feels, joystick command) -> joint targets. Trained on {steps:,} "
        f"control steps with {updates:,} updates."
    )
    rows = _figures(actor, spec, limits) | {"lag": f"{ways.lag_s:.2f} s"}
    text = card(f"Walking policy: {spec.name}", what, run, rows)
    weights = network_of(actor, joints)
    return save_artifact(run.out, kind=KIND, config=asdict(settings), weights=weights, card=text, log=run.log)


def _settings(
    spec: RobotSpec, joints: JointInterface, limits: Box, ways: WalkingMeasured, config: WalkingConfig, run: Run
) -> WalkingSettings:
    """All that whoever walks by it has to know."""
    return WalkingSettings(
        robot=spec.name,
        control_dt=spec.control_dt,
        inputs=joints.inputs,
        joints=joints.names,
        rest=tuple(joints.rest.tolist()),
        action_scale=tuple(joints.scale.tolist()),
        stiffness=tuple(joints.gains[0].tolist()),
        damping=tuple(joints.gains[1].tolist()),
        low=_three(limits.low),
        high=_three(limits.high),
        dead=_three(0.0 if slowest == np.inf else slowest for slowest in ways.dead),
        drift=_three(ways.drift),
        hidden=config.sac.hidden,
        training=run.training(config),
    )


def _three(numbers: Iterable[float]) -> Three:
    forward, sideways, turn = (round(float(number), 3) + 0.0 for number in numbers)
    return forward, sideways, turn


def _figures(actor: Actor, spec: RobotSpec, limits: Box) -> dict[str, str]:
    """Rows of the card."""
    batch = ActorFollower(spec, measure.COMMANDS, actor)
    missed = measure.measure(batch, limits, measure.LASTS_S)
    condition = f"{measure.COMMANDS} held-out commands, {measure.LASTS_S:g} s: median / p95 error"
    rows = {
        f"{way} in [{low:g}, {high:g}] {unit}, {condition}": (
            f"{missed[f'{way} median']:.3f} / {missed[f'{way} p95']:.3f} {unit}"
        )
        for way, unit, low, high in zip(WAYS, UNITS, limits.low, limits.high, strict=True)
    }
    slowest, fastest = measure.SLOW
    stress = (
        f"pushes to {measure.PUSH:g} m/s and new commands every {measure.PUSH_EVERY_S:g} s, {measure.STRESSED_S:g} s"
    )
    return rows | {
        "fell": f"{100 * missed['fell']:.1f} %",
        f"slow commands, {slowest:g} to {fastest:g} m/s in any direction: median error": (
            f"{measure.slow_error(spec, actor):.3f} m/s"
        ),
        f"no command: distance after {measure.STANDS_S:g} s, median": f"{measure.stand(spec, actor):.3f} m",
        f"fell under {stress}": f"{100 * measure.stressed(spec, actor, limits):.1f} %",
    }
