"""Where reuse breaks: final error over the hidden target, inside and outside of what the module learned on.

    .venv/bin/python benchmarks/limits.py [--inference goal-velocity ...] [--robots cheetah ...] [--out runs/limits.png]

Every target of a grid, front and back, once per start of 3; a robot is asked for no speed beyond its tracker's reach.
"""

import argparse
from pathlib import Path

import numpy as np

from rebody.agents.parts import load_inference
from rebody.bodies import RobotSpec, load_robot
from rebody.cli.trial import TrialOptions
from rebody.evaluation import evaluate
from rebody.report.style import figure
from rebody.tasks.task_file import TaskSpec

GOALS = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 12.0, 15.0, 18.0, 22.0, 26.0)
SPEEDS = (0.1, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5)
SEEDS = 3


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inference", nargs="*", default=["goal-velocity"])
    parser.add_argument("--robots", nargs="*", default=["cheetah", "hopper", "walker"])
    parser.add_argument("--out", type=Path, default=Path("runs/limits.png"))
    arguments = parser.parse_args()
    found = {(robot, name): errors_of(robot, name) for robot in arguments.robots for name in arguments.inference}
    show(found)
    draw(found, load_inference(arguments.inference[0]).contract.families.ranges, arguments.out)


def errors_of(robot: str, name: str) -> dict[str, dict[float, float]]:
    """Per family the median final error at each target [m, m/s]."""
    specs = tasks_within(load_robot(robot))
    errors: dict[str, dict[float, list[float]]] = {"goal": {}, "velocity": {}}
    for episode in evaluate(TrialOptions(robot=robot, inference=name, no_sharpen=True).load(), specs, SEEDS).episodes:
        errors[episode.family].setdefault(episode.target[0], []).append(episode.final_error)
    return {
        family: {target: float(np.median(of)) for target, of in sorted(by_target.items())}
        for family, by_target in errors.items()
    }


def tasks_within(spec: RobotSpec) -> list[TaskSpec]:
    """The grid, without speeds that the robot cannot run at."""
    reached = dict(spec.reach)["velocity"]
    goals = [TaskSpec("goal", (sign * goal,)) for goal in GOALS for sign in (-1, 1)]
    speeds = [sign * speed for speed in SPEEDS for sign in (-1, 1)]
    return goals + [TaskSpec("velocity", (each,)) for each in speeds if reached.low[0] <= each <= reached.high[0]]


def show(found: dict[tuple[str, str], dict[str, dict[float, float]]]) -> None:
    """A Markdown table per family: a row per target."""
    for family, unit in (("goal", "m"), ("velocity", "m/s")):
        print(f"| {family} [{unit}] | {' | '.join(f'{robot}, {name}' for robot, name in found)} |")
        print(f"|---|{'---|' * len(found)}")
        for target in sorted({target for errors in found.values() for target in errors[family]}):
            cells = [f"{errors[family][target]:.3f}" if target in errors[family] else "" for errors in found.values()]
            print(f"| {target:g} | {' | '.join(cells)} |")
        print()


def draw(found: dict[tuple[str, str], dict[str, dict[float, float]]], learned: dict, out: Path) -> None:
    """A line per robot and module; shaded what the module learned on."""
    with figure(out, 1, 2, size=(11.0, 4.4)) as (_, all_axes):
        for axes, family, unit in zip(all_axes, ("goal", "velocity"), ("m", "m/s"), strict=True):
            for (robot, name), errors in found.items():
                targets = list(errors[family])
                axes.plot(targets, [errors[family][target] for target in targets], "o-", ms=3, label=f"{robot}, {name}")
            axes.axvspan(learned[family].low[0], learned[family].high[0], color="#eeeeee", zorder=0)
            axes.set(xlabel=f"hidden {family} [{unit}]", ylabel=f"final error [{unit}]", yscale="log")
            axes.legend(frameon=False, fontsize=8)


if __name__ == "__main__":
    main()
