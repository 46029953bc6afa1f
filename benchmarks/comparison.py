"""Ways to act on a robot, side by side: one table, one page (thesis 6.5.3).

    .venv/bin/python benchmarks/comparison.py [--robots cheetah ...] [--inference goal-velocity ...] [--seeds 1]

Every agent on the same hidden tasks of each robot, and every module: those beyond the first differ in how the toy was
randomised. What has no artifact is left out, what was judged before is not judged again. The page, `comparison.html`
in `--out`, has intervals, pictures and every episode.
"""

import argparse
import sys
from pathlib import Path

from agents import cell
from rebody.cli.trial import TrialOptions
from rebody.errors import RebodyError
from rebody.evaluation import Results, evaluate, read_results, save_results
from rebody.evaluation.evaluate import Trial
from rebody.report.page import find, write_page
from rebody.store import load_artifact
from rebody.tasks.task_file import read_tasks

TASKS = Path(__file__).parent / "tasks"
WITHOUT_MODULE = ("idle", "scratch", "bayes", "oracle")
WITH_MODULE = ("reuse", "readout", "retrain", "flat")
MODULES = ("goal-velocity", "goal-velocity-noise-0", "goal-velocity-noise-0.1", "goal-velocity-noise-0.2")
COLUMNS = (
    "robot", "module", "agent", "goal: median error [m]", "velocity: median error [m/s]", "return",
    "base task right [%]", "fell [%]", "robot steps [million]", "training [min]",
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", nargs="*", default=["cheetah", "walker", "hopper"])
    parser.add_argument("--inference", nargs="*", default=MODULES)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("runs/comparison"))
    arguments = parser.parse_args()
    print(f"| {' | '.join(COLUMNS)} |\n|{'---|' * len(COLUMNS)}")
    for robot in arguments.robots:
        ways = [(arguments.inference[0], agent) for agent in WITHOUT_MODULE]
        ways += [(module, agent) for module in arguments.inference for agent in WITH_MODULE]
        for module, agent in ways:
            compare(TrialOptions(robot=robot, inference=module, agent=agent), arguments.seeds, arguments.out)
    page = arguments.out / "comparison.html"
    write_page([find(str(arguments.out))], page)
    print(f"\n{page}")


def compare(options: TrialOptions, seeds: int, out: Path) -> None:
    """Print a row, if there are the parts for it."""
    try:
        trial = options.load()
        results = judge(trial, out / f"{options.robot}-{trial.inference.name}-{options.agent}-{seeds}.json", seeds)
    except RebodyError as error:
        print(f"{options.robot}, {options.inference}, {options.agent}: left out, {error}", file=sys.stderr)
        return
    families, steps_and_minutes = results.summary["families"], costs(trial)
    cells = [
        options.robot,
        "" if options.agent in WITHOUT_MODULE else options.inference,
        options.agent,
        *(cell(families[family]["median_error"]) for family in ("goal", "velocity")),
        f"{sum(episode.return_ for episode in results.episodes) / len(results.episodes):.1f}",
        f"{100 * min(families[family]['base_task_right']['value'] for family in families):.1f}",
        f"{100 * results.summary['fell']['value']:.1f}",
        *(f"{value:.1f}" for value in steps_and_minutes),
    ]
    print(f"| {' | '.join(cells)} |", flush=True)


def judge(trial: Trial, path: Path, seeds: int) -> Results:
    """Out of the file, or anew."""
    if path.exists():
        return read_results(path)
    assert trial.robot is not None
    results = evaluate(trial, read_tasks(TASKS / f"goal-velocity-{trial.robot.name}.json"), seeds)
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


if __name__ == "__main__":
    main()
