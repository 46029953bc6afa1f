"""Thesis mode with fixed and with predicted strides on the cheetah, and our mode beside it, on the same tasks.

    .venv/bin/python benchmarks/step_predictor.py [--tasks FILE] [--seeds 1] [--seconds 20] [--step-predictor ART]

`goal-velocity`, frozen, zero-shot; strides in control steps of 0.05 s. All have the same simulated time, which is what
a robot pays with: a longer stride means fewer decisions. Thesis mode looks one decision ahead, ours 15 and decides
every 0.1 s. Final errors and regret as everywhere (docs/robots.md); brackets: 95 % bootstrap intervals over episodes.
"""

import argparse
from pathlib import Path

from rebody.cli.trial import TrialOptions
from rebody.evaluation import Results, evaluate
from rebody.tasks import SHIPPED
from rebody.tasks.task_file import read_tasks

TASKS = Path(__file__).parent / "tasks" / "goal-velocity-cheetah.json"
STRIDES = (1, 5, 10, "predicted")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tasks", type=Path, default=TASKS)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--step-predictor", default="step-predictor-cheetah")
    options = parser.parse_args()
    specs = read_tasks(options.tasks, SHIPPED)
    trials = {
        f"thesis mode, stride {stride}": TrialOptions(
            seconds=options.seconds, thesis=True, stride=stride, step_predictor=options.step_predictor
        )
        for stride in STRIDES
    } | {"our mode": TrialOptions(seconds=options.seconds, no_sharpen=True)}
    print("| | goal: median error [m] | 95th percentile | velocity: median error [m/s] | 95th percentile | regret |")
    print("|---|---|---|---|---|---|")
    for name, trial in trials.items():
        print(row(name, evaluate(trial.load(), specs, options.seeds)), flush=True)


def row(name: str, results: Results) -> str:
    """A line of the table."""
    families = results.summary["families"]
    errors = [families[family][key] for family in ("goal", "velocity") for key in ("median_error", "p95_error")]
    figures = [*errors, results.summary["regret"]]
    cells = [f"{figure['value']:.3f} [{figure['low']:.3f}, {figure['high']:.3f}]" for figure in figures]
    return f"| {name} | " + " | ".join(cells) + " |"


if __name__ == "__main__":
    main()
