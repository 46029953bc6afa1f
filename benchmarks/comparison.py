"""Ways to act on a robot, side by side: one table, one picture, one page (thesis 6.5.3).

    .venv/bin/python benchmarks/comparison.py [--robots cheetah ...] [--inference goal-velocity ...] [--seeds 1]

Every agent on the same hidden tasks of each robot, and every module: those beyond the first differ in how the toy was
randomised. What has no artifact is left out, what was judged before is not judged again. The page, `comparison.html`
in `--out`, has intervals, pictures and every episode.
"""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

from agents import cell
from rebody.cli.trial import TrialOptions
from rebody.errors import RebodyError
from rebody.evaluation import Results, evaluate, read_results, save_results
from rebody.evaluation.trial import Trial
from rebody.names import AGENTS
from rebody.report.page import find, write_page
from rebody.report.style import figure
from rebody.store import load_artifact
from rebody.tasks import SHIPPED
from rebody.tasks.task_file import read_tasks

TASKS = Path(__file__).parent / "tasks"
WITHOUT_MODULE = ("idle", "scratch", "bayes", "oracle")
WITH_MODULE = ("reuse", "readout", "retrain", "flat")
MODULES = ("goal-velocity", "goal-velocity-noise-0", "goal-velocity-noise-0.1", "goal-velocity-noise-0.2")
FAMILIES = {"goal": "m", "velocity": "m/s"}
COLUMNS = (
    "robot", "module", "agent", "goal: median error [m]", "velocity: median error [m/s]", "return",
    "base task right [%]", "fell [%]", "robot steps [million]", "training [min]",
)  # fmt: skip


@dataclass(frozen=True)
class Row:
    """A way to act on a robot, and what came of it."""

    robot: str
    module: str
    agent: str
    results: Results
    steps: float
    """Control steps that the robot took for all that was trained on it [million]."""
    minutes: float
    """How long that took."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", nargs="*", default=["cheetah", "walker", "hopper"])
    parser.add_argument("--inference", nargs="*", default=MODULES)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("runs/comparison"))
    arguments = parser.parse_args()
    first, rows = arguments.inference[0], []
    print(f"| {' | '.join(COLUMNS)} |\n|{'---|' * len(COLUMNS)}")
    for robot in arguments.robots:
        ways = [(first, agent) for agent in WITHOUT_MODULE]
        ways += [(module, agent) for module in arguments.inference for agent in WITH_MODULE]
        for module, agent in ways:
            options = TrialOptions(robot=robot, inference=module, agent=agent, no_sharpen=True)
            try:
                row = compare(options, arguments.seeds, arguments.out)
            except RebodyError as error:
                print(f"{robot}, {module}, {agent}: left out, {error}", file=sys.stderr)
            else:
                rows.append(row)
                print(f"| {' | '.join(cells(row))} |", flush=True)
    draw([row for row in rows if row.module == first], arguments.out / "comparison.png")
    page = arguments.out / "comparison.html"
    write_page([find(str(arguments.out))], page)
    print(f"\n{page}")


def compare(options: TrialOptions, seeds: int, out: Path) -> Row:
    """Judge one way; RebodyError if there are no parts for it."""
    trial = options.load()
    results = judge(trial, out / f"{options.robot}-{trial.inference.name}-{options.agent}-{seeds}.json", seeds)
    return Row(options.robot, options.inference, options.agent, results, *costs(trial))


def judge(trial: Trial, path: Path, seeds: int) -> Results:
    """Out of the file, or anew."""
    if path.exists():
        return read_results(path)
    assert trial.robot is not None
    results = evaluate(trial, read_tasks(TASKS / f"goal-velocity-{trial.robot.name}.json", SHIPPED), seeds)
    save_results(results, path)
    return results


def costs(trial: Trial) -> tuple[float, float]:
    """Control steps that the robot took for all that was trained on it [million], and how long that took [min]."""
    assert trial.robot is not None
    tracker = None if trial.flat or trial.scratch else trial.tracker
    parts = {"tracker": tracker, "high-level": trial.high_level, "flat": trial.flat, "scratch": trial.scratch}
    steps = seconds = 0.0
    for kind, part in ((kind, part) for kind, part in parts.items() if part):
        training = load_artifact(part.name, kind).config["training"]
        per_step = trial.robot.steps_per_decision if kind in ("high-level", "scratch") else 1
        in_iteration = training["decisions"] if kind == "scratch" else training["steps"]
        steps += training["robots"] * in_iteration * training["iterations"] * per_step / 1e6
        seconds += training["wall_s"]
    return steps, seconds / 60


def cells(row: Row) -> list[str]:
    """A row of the table."""
    families, episodes = row.results.summary["families"], row.results.episodes
    return [
        row.robot,
        "" if row.agent in WITHOUT_MODULE else row.module,
        row.agent,
        *(cell(families[family]["median_error"]) for family in FAMILIES),
        f"{sum(episode.return_ for episode in episodes) / len(episodes):.1f}",
        f"{100 * min(families[family]['base_task_right']['value'] for family in families):.1f}",
        f"{100 * row.results.summary['fell']['value']:.1f}",
        f"{row.steps:.1f}",
        f"{row.minutes:.1f}",
    ]


def draw(rows: list[Row], path: Path) -> None:
    """Errors of every agent, a colour per robot, and the robot steps that each took to train."""
    agents = [agent for agent in reversed(AGENTS) if any(row.agent == agent for row in rows)]
    robots = list(dict.fromkeys(row.robot for row in rows))
    with figure(path, 1, 3, size=(12.0, 3.8)) as (_, (*by_family, steps)):
        for i, robot in enumerate(robots):
            of_robot = [row for row in rows if row.robot == robot]
            # side by side in the line of their agent
            lines = [agents.index(row.agent) + 0.15 * (i - (len(robots) - 1) / 2) for row in of_robot]
            for axes, (family, unit) in zip(by_family, FAMILIES.items(), strict=True):
                figures = [row.results.summary["families"][family]["median_error"] for row in of_robot]
                values = [of["value"] for of in figures]
                ends = [[abs(of[end] - of["value"]) for of in figures] for end in ("low", "high")]
                axes.errorbar(values, lines, xerr=ends, fmt="o", ms=4, color=f"C{i}", label=robot)
                axes.set(xlabel=f"{family}: median error [{unit}]", xscale="log")
            steps.barh(lines, [row.steps for row in of_robot], height=0.13, color=f"C{i}")
        steps.set(xlabel="robot steps of its training [million]")
        for axes in (*by_family, steps):
            axes.set_yticks(range(len(agents)), agents if axes is by_family[0] else [])
            axes.grid(axis="x", color="#eeeeee")
            axes.set_axisbelow(True)
        by_family[0].legend(frameon=False, fontsize=8, loc="center right")


if __name__ == "__main__":
    main()
