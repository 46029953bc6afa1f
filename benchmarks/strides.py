"""The stride table: `position-thesis` in thesis mode on the cheetah at five strides, and our mode beside it.

    .venv/bin/python benchmarks/strides.py [--tasks FILE] [--seeds 3] [--out docs/position]

Every stride gets the time that it needs to arrive, since it makes at most 0.1 m at a time. Final error: mean |x - goal|
over the last 2 s. Oscillation: standard deviation of x over the last fifth of the episode. Settled: from when on x
stays within 0.25 m of the goal. Brackets: 95 % bootstrap intervals over episodes. Takes about 15 minutes.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from rebody.agents.parts import load_inference, load_tracker
from rebody.bodies import load_robot
from rebody.evaluation.evaluate import run_trial, start_seeds, trial_agent
from rebody.evaluation.summary import percentile_95, with_interval
from rebody.evaluation.trial import Trial
from rebody.report.style import BELIEF, MOTION, figure
from rebody.tasks import SHIPPED
from rebody.tasks.figures import final_error
from rebody.tasks.task_file import TaskSpec, active_tasks, read_tasks
from rebody.types import DECISION_DT, Task

TASKS = Path(__file__).parent / "tasks" / "position-thesis.json"
SECONDS = {1: 40.0, 5: 60.0, 10: 80.0, 50: 350.0, 100: 700.0}
WITHIN = 0.25


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tasks", type=Path, default=TASKS)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--out", type=Path, default=Path("docs/position"))
    options = parser.parse_args()
    specs = [spec for spec in read_tasks(options.tasks, SHIPPED) for _ in range(options.seeds)]
    seeds = np.tile(np.arange(options.seeds), len(specs) // options.seeds)

    measured = {}
    for name, trial in trials().items():
        measured[name] = measure(trial, specs, seeds)
        print(f"{name}: {json.dumps(summary(measured[name]))}", flush=True)
    print_table(measured)
    compare(measured)
    plot(measured, options.out / "strides.png")


def trials() -> dict[str, Trial]:
    """Thesis mode at each stride, and our mode."""
    robot, tracker = load_robot("cheetah"), load_tracker("tracker-cheetah")
    parts = load_inference("position-thesis"), SHIPPED, robot, tracker
    thesis = {
        f"thesis mode, stride {stride}": Trial("reuse", *parts, seconds=seconds, stride=stride, horizon=1, thesis=True)
        for stride, seconds in SECONDS.items()
    }
    return thesis | {"our mode": Trial("reuse", load_inference("position"), SHIPPED, robot, tracker)}


def measure(trial: Trial, specs: list[TaskSpec], seeds: np.ndarray) -> dict[str, np.ndarray]:
    """Error [m], oscillation [m] and settling time [s, infinite if never] of each episode."""
    tasks = active_tasks(specs, trial.in_play, trial.decisions, DECISION_DT)
    episodes = run_trial(trial, trial_agent(trial, tasks), tasks, start_seeds(specs, seeds))
    x, target = np.asarray(episodes.state.x, float), np.array([spec.target[0] for spec in specs])
    outside = np.abs(x - target) > WITHIN
    last_outside = len(x) - 1 - np.argmax(outside[::-1], axis=0)
    settled = np.where(outside.any(0), DECISION_DT * (last_outside + 2), DECISION_DT)
    return {
        "error": final_error(trial.in_play, Task(tasks.family[-1], tasks.target[-1]), episodes.state),
        "oscillation": x[-len(x) // 5 :].std(axis=0),
        "settled": np.where(outside[-1], np.inf, settled),
        "fell": np.asarray(episodes.fell),
    }


def summary(figures: dict[str, np.ndarray]) -> dict[str, dict[str, float]]:
    """Statistics with intervals."""
    return {
        "median error [m]": with_interval(figures["error"], np.median),
        "95th percentile [m]": with_interval(figures["error"], percentile_95),
        "oscillation, median [m]": with_interval(figures["oscillation"], np.median),
        "settled, median [s]": with_interval(np.nan_to_num(figures["settled"], posinf=1e4), np.median),
        "never settled [%]": with_interval(100.0 * np.isinf(figures["settled"]), np.mean),
        "fell [%]": with_interval(100.0 * figures["fell"], np.mean),
    }


def print_table(measured: dict[str, dict[str, np.ndarray]]) -> None:
    names = list(summary(next(iter(measured.values()))))
    print("\n| | " + " | ".join(names) + " |\n|" + "---|" * (len(names) + 1))
    for name, figures in measured.items():
        cells = [f"{f['value']:.3g} [{f['low']:.3g}, {f['high']:.3g}]" for f in summary(figures).values()]
        print(f"| {name} | " + " | ".join(cells) + " |")


def compare(measured: dict[str, dict[str, np.ndarray]]) -> None:
    """Our mode against the best stride, episode by episode."""
    ours = measured["our mode"]
    strides = {name: figures for name, figures in measured.items() if name != "our mode"}
    for key, unit in (("error", "m"), ("settled", "s")):
        best = min(strides, key=lambda name: np.median(strides[name][key]))
        difference = np.nan_to_num(ours[key], posinf=1e4) - np.nan_to_num(strides[best][key], posinf=1e4)
        median = with_interval(difference, np.median)
        print(
            f"\nour mode minus {best} (the best in {key}), same goal and seed, median difference: "
            f"{median['value']:.3g} {unit} [{median['low']:.3g}, {median['high']:.3g}]"
        )


def plot(measured: dict[str, dict[str, np.ndarray]], path: Path) -> None:
    """Error, oscillation and settling time as functions of the stride."""
    strides = list(SECONDS)
    with figure(path, 1, 3, size=(12.0, 3.8)) as (_, panels):
        keys = ("median error [m]", "oscillation, median [m]", "settled, median [s]")
        for axes, key in zip(panels, keys, strict=True):
            figures = [summary(measured[f"thesis mode, stride {stride}"])[key] for stride in strides]
            values = np.array([[f["value"], f["low"], f["high"]] for f in figures])
            bars = np.abs(values[:, 1:].T - values[:, 0])
            axes.errorbar(strides, values[:, 0], bars, fmt="o-", color=MOTION, capsize=3, label="thesis mode")
            ours = summary(measured["our mode"])[key]["value"]
            axes.axhline(ours, color=BELIEF, ls="--", label="our mode")
            axes.set(xscale="log", yscale="log", xlabel="stride [control steps of 0.05 s]", ylabel=key)
            axes.set_xticks(strides, [str(stride) for stride in strides])
            axes.minorticks_off()
        panels[0].legend(frameon=False)


if __name__ == "__main__":
    main()
