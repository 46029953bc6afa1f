"""Rewards as people pay them: one frozen module on robots, under laws of which none was drawn when it learned.

    .venv/bin/python benchmarks/any_law.py [--robots quadruped ...] [--laws half-metres ...] [--tasks 30] [--json FILE]

A row is a law. Every law has the same hidden tasks, the first ones of each family, and the same starts. `share` is
(return - idle) / (oracle - idle) in the law's own rewards, costs included; the oracle is told the task and has the same
tracker. The first row is the families' own law, which all errors are compared with.
"""

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from rebody.cli.trial import TrialOptions
from rebody.evaluation import Results, evaluate
from rebody.evaluation.evaluate import Yardsticks, take_yardsticks
from rebody.evaluation.statistics import percentile_95, share_of_oracle, with_interval
from rebody.evaluation.trial import Trial
from rebody.tasks import SHIPPED, Payment
from rebody.tasks.task_file import TaskSpec, read_tasks
from rebody.types import DECISION_DT

TASKS = Path(__file__).parent / "tasks"


@dataclass(frozen=True)
class Setting:
    """A robot, what it believes with, and what it is asked for."""

    inference: str
    tasks: str
    seconds: float
    joints: int


SETTINGS = {
    "cheetah": Setting("goal-velocity-any", "goal-velocity-cheetah.json", 20.0, 6),
    "walker": Setting("goal-velocity-any", "goal-velocity-walker.json", 20.0, 6),
    "hopper": Setting("goal-velocity-any", "goal-velocity-hopper.json", 20.0, 3),
    "quadruped": Setting("plane-any", "plane-go1.json", 40.0, 12),
}
OWN = "own"
HELD_OUT = {
    OWN: Payment(relative=True),
    # forms that are not drawn
    "power-1.5": Payment(form="power", exponent=1.5),
    "root": Payment(form="power", exponent=0.5, relative=True),
    "cubic": Payment(form="power", exponent=3.0, relative=True, scale=5.0),
    # scales and bonuses beyond those that are drawn
    "centimetres": Payment(scale=100.0),
    "half-metres-l1": Payment(form="l1", scale=2.0, offset=-1.0),
    "high-bonus": Payment(relative=True, offset=20.0),
    # 3 exp(-e^2 / s^2) + 1, in sizes of the target
    "gaussian-half": Payment(form="gaussian", relative=True, scale=3.0, offset=1.0, width=0.5),
    "gaussian-third": Payment(form="gaussian", relative=True, scale=3.0, offset=1.0, width=1 / 3),
    # -0.2 |e| - 0.05 sum of squared actions: the price of a mean squared action is set by the number of joints
    "control-cost": Payment(scale=0.2, control_cost=0.05),
    "noisy": Payment(relative=True, noise=0.05),
    "late": Payment(delay_s=0.3),
    "gaps": Payment(form="squared", relative=True, dropped=0.5),
}
"""By name; each is held out by something: a form, a range, gaps, or all of it at once."""
SPARSE = {
    "gaussian-fifth": Payment(form="gaussian", relative=True, width=0.2),
    "gaussian-tenth": Payment(form="gaussian", relative=True, width=0.1),
    "sparse-half": Payment(form="sparse", relative=True, width=0.5),
    "sparse-fifth": Payment(form="sparse", relative=True, width=0.2),
}
"""Where it begins to fail: nothing is heard until the target is near, and nothing searches."""
LAWS = HELD_OUT | SPARSE
SETTLED_S, NAMED_AFTER = 3.0, 20
"""From when on the second share counts, and decisions after which the family is judged."""
COLUMNS = ("law", "share", f"share after {SETTLED_S:g} s", f"family after {NAMED_AFTER} [%]", "fell [%]")


@dataclass(frozen=True)
class Measured:
    """What came of one law on one robot."""

    robot: str
    law: str
    episodes: int
    share: dict[str, float]
    settled_share: dict[str, float]
    named: float
    fell: float
    errors: dict[str, tuple[float, float]]
    """Of each family the median and the 95th percentile [m, m/s, rad]."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", nargs="*", default=["cheetah", "walker", "quadruped"], choices=SETTINGS)
    parser.add_argument("--laws", nargs="*", default=list(HELD_OUT), choices=LAWS, metavar="LAW")
    parser.add_argument("--inference", help="another module than the robot's")
    parser.add_argument("--tasks", type=int, default=30, help="of each robot, the first ones of every family")
    parser.add_argument("--json", type=Path, help="file for all figures")
    options = parser.parse_args()
    measured = []
    for robot in options.robots:
        of_robot = []
        for each in under_laws(robot, options.inference, options.laws, options.tasks):
            print_row(each, of_robot)
            of_robot.append(each)
        measured += of_robot
    if options.json is not None:
        options.json.write_text(json.dumps([vars(each) for each in measured], indent=1))


def under_laws(robot: str, inference: str | None, laws: Sequence[str], tasks: int) -> Iterator[Measured]:
    """One robot on the same tasks under each law."""
    setting = SETTINGS[robot]
    module = inference or setting.inference
    trial = TrialOptions(robot=robot, inference=module, seconds=setting.seconds).load()
    specs = some_of(read_tasks(TASKS / setting.tasks, SHIPPED), tasks)
    for law in laws:
        payment = LAWS[law]
        paid = replace(payment, control_cost=payment.control_cost * setting.joints)
        yield measure(replace(trial, payment=paid), law, specs)


def some_of(specs: list[TaskSpec], number: int) -> list[TaskSpec]:
    """The first tasks of every family, as many of each."""
    names = list(dict.fromkeys(spec.family for spec in specs))
    each = -(-number // len(names))
    return [spec for name in names for spec in [s for s in specs if s.family == name][:each]]


def measure(trial: Trial, law: str, specs: list[TaskSpec]) -> Measured:
    """The agent on all tasks under one law, beside oracle and idle."""
    yardsticks = take_yardsticks(trial, specs, seeds=1)
    results = evaluate(trial, specs, 1, yardsticks)
    shares = [share(results, yardsticks, round(after / DECISION_DT)) for after in (0.0, SETTLED_S)]
    episodes = results.episodes
    named = [each.inferred_family[NAMED_AFTER - 1] == each.active_family[-1] for each in episodes]
    errors = {}
    for family in results.families:
        own = np.array([each.final_error for each in results.of(family.name)])
        errors[family.name] = (float(np.median(own)), percentile_95(own))
    fell = float(np.mean([each.fell for each in episodes]))
    return Measured(trial.robot_name, law, len(episodes), *shares, float(np.mean(named)), fell, errors)


def share(results: Results, yardsticks: Yardsticks, first: int) -> dict[str, float]:
    """(return - idle) / (oracle - idle) from a decision on, with its interval over tasks."""
    assert yardsticks.oracle is not None
    assert yardsticks.idle is not None
    own = np.array([each.reward for each in results.episodes])[:, first:].sum(axis=1)
    others = [np.asarray(each.reward)[first:].sum(axis=0) for each in (yardsticks.oracle, yardsticks.idle)]
    tasks = [each.task for each in results.episodes]
    return with_interval(np.stack([own, *others], axis=1), share_of_oracle, tasks)


def print_row(measured: Measured, before: list[Measured]) -> None:
    """A line of the robot's table, under its head; errors beside their ratio to those of the first law."""
    if not before:
        families = [f"{name}: median / p95, ratio of medians" for name in measured.errors]
        print(f"\n{measured.robot}, {measured.episodes} episodes\n\n| {' | '.join((*COLUMNS, *families))} |")
        print("|---" * (len(COLUMNS) + len(families)) + "|")
    reference: Any = (before or [measured])[0].errors
    errors = [
        f"{median:.3f} / {p95:.3f}, {median / reference[name][0]:.1f}"
        for name, (median, p95) in measured.errors.items()
    ]
    shares = [interval(figure) for figure in (measured.share, measured.settled_share)]
    cells = [measured.law, *shares, f"{100 * measured.named:.0f}", f"{100 * measured.fell:.1f}", *errors]
    print(f"| {' | '.join(cells)} |", flush=True)


def interval(figure: dict[str, float]) -> str:
    return f"{figure['value']:.3f} [{figure['low']:.3f}, {figure['high']:.3f}]"


if __name__ == "__main__":
    main()
