"""Section 6.5.1 of the thesis: high-level policies that were learned on robots, with the frozen module."""

from collections.abc import Mapping
from pathlib import Path

from rebody.agents.parts import load_high_level, load_inference, load_tracker
from rebody.bodies import load_robot
from rebody.evaluation.evaluate import Trial
from rebody.report.style import BELIEF, IDLE, MOTION, ORACLE, TRUTH, figure
from rebody.report.thesis.data import Data, join, split, training_log, trajectories
from rebody.report.thesis.panels import caption, draw_curve
from rebody.report.thesis.several_families import draw_ways_of_each, tasks_of_each_kind, ways_panels
from rebody.report.thesis.zero_shot import drawn
from rebody.training.high_level import HighLevelConfig, train_high_level

Policies = Mapping[tuple[str, str], str]
"""Modules and robots of policies that ship, and their colours."""

ON_CHEETAH: Policies = {("goal-velocity", "cheetah"): MOTION, ("goal-velocity-noise-0", "cheetah"): BELIEF}
BALANCING: Policies = {("goal-velocity", "walker"): TRUTH, ("goal-velocity", "hopper"): IDLE}
STANDING = ("goal-velocity-stand", "cheetah")
POLICIES: Policies = {**ON_CHEETAH, **BALANCING, STANDING: ORACLE}


# 6.19


def training() -> Data:
    """Of the shipped policies."""
    return join({_name(*of): training_log(_name(*of), "high-level") for of in POLICIES})


def train_again(runs: Path) -> Data:
    """Of policies trained anew."""
    logs = {}
    for module, robot in POLICIES:
        out = runs / _name(module, robot)
        train_high_level(robot, module, None, HighLevelConfig(), out, 0, resume=True)
        logs[_name(module, robot)] = training_log(out, "high-level")
    return join(logs)


def draw_training(data: Data, path: Path, text: str) -> None:
    """Return of held-out tasks over decisions."""
    with figure(path, 1, 1, size=(7.5, 4.4)) as (drawing, (axes,)):
        for (module, robot), colour in POLICIES.items():
            log = split(data, _name(module, robot))
            draw_curve(axes, log, "evaluation/return", f"{robot}, {module}", colour=colour, dots=True)
        axes.set(xlabel="decisions on the robot [million]", ylabel="return over 20 s")
        axes.legend(frameon=False, fontsize=8)
        caption(drawing, text)


# 6.20 to 6.22


def on_robots(policies: Policies) -> Data:
    """Each policy on its robot, on tasks of each kind that it is fast enough for."""
    return join({_name(module, robot): _judged(module, robot) for module, robot in policies})


def draw_ways(policies: Policies, data: Data, path: Path, text: str) -> None:
    """A row per policy: goals and speeds."""
    titles = {_name(module, robot): f"{robot}, {module}" for module, robot in policies}
    draw_ways_of_each(data, titles, path, text)


def standing() -> Data:
    """The policy that has stands among its tasks."""
    return _judged(*STANDING)


def draw_standing(data: Data, path: Path, text: str) -> None:
    """Goals, speeds and pitches."""
    with figure(path, 1, 3, size=(14.0, 4.4)) as (drawing, panels):
        ways_panels(panels, data)
        caption(drawing, text)


def _judged(module: str, robot: str) -> Data:
    spec, tracker, policy = load_robot(robot), load_tracker(f"tracker-{robot}"), load_high_level(_name(module, robot))
    trial = Trial("retrain", load_inference(module), spec, tracker, high_level=policy)
    return drawn(trajectories(trial, tasks_of_each_kind(tracker.tracker.reach, module.removesuffix("-noise-0"))))


def _name(module: str, robot: str) -> str:
    return f"high-level-{module}-{robot}"
