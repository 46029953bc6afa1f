"""What costs what: every agent on the same hidden goals, on the cheetah and on the toy.

    .venv/bin/python benchmarks/agents.py [--seeds 3]

From one row to the next one part is exchanged. On the toy there is neither bridge nor tracker.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from rebody.agents.parts import load_flat, load_inference, load_tracker
from rebody.bodies import load_robot
from rebody.evaluation import Results, evaluate
from rebody.evaluation.statistics import with_interval
from rebody.evaluation.trial import Trial
from rebody.tasks import SHIPPED
from rebody.tasks.task_file import read_tasks

TASKS = Path(__file__).parent / "tasks"
PARTS = {
    "oracle": "told the goal",
    "bayes": "exact posterior",
    "readout": "module, linear probe",
    "reuse": "module, the toy's policy (and bridge)",
    "flat": "module, flat policy",
    "idle": "nothing: stands still",
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=3)
    seeds = parser.parse_args().seeds
    module = load_inference("position")
    toy = Trial("reuse", module, SHIPPED, None, None)
    show("point mass", toy, "position-toy.json", 1, [agent for agent in PARTS if agent != "flat"])
    cheetah = Trial(
        "reuse",
        module,
        SHIPPED,
        load_robot("cheetah"),
        load_tracker("tracker-cheetah"),
        flat=load_flat("flat-position-cheetah"),
    )
    results = show("cheetah", cheetah, "position-cheetah.json", seeds, list(PARTS))
    print_share(results)


def show(body: str, trial: Trial, file: str, seeds: int, agents: list[str]) -> dict[str, Results]:
    print(f"\n{body}, {file}, {seeds} evaluation seeds\n")
    print("| agent | parts | median error [m] | 95th percentile [m] | regret | fell [%] |\n|---|---|---|---|---|---|")
    results = {}
    for agent in agents:
        results[agent] = evaluate(replace(trial, agent=agent), read_tasks(TASKS / file, SHIPPED), seeds)
        summary = results[agent].summary
        goal = summary["families"]["goal"]
        cells = [cell(figures) for figures in (goal["median_error"], goal["p95_error"], summary["regret"])]
        fell = 100 * summary["fell"]["value"]
        print(f"| {agent} | {PARTS[agent]} | {' | '.join(cells)} | {fell:.1f} |", flush=True)
    return results


def cell(figures: dict[str, float]) -> str:
    value, low, high = (figures[end] for end in ("value", "low", "high"))
    return f"{value:.3f}" if low == high else f"{value:.3f} [{low:.3f}, {high:.3f}]"


def print_share(results: dict[str, Results]) -> None:
    """(idle - flat) / (idle - reuse) in median error: 1 if flat does as well, 0 if it does nothing."""
    errors = np.array([[e.final_error for e in results[agent].episodes] for agent in ("idle", "flat", "reuse")]).T

    def share(rows: np.ndarray) -> float:
        idle, flat, reuse = np.median(rows, axis=0)
        return float((idle - flat) / (idle - reuse))

    print(f"\n(idle - flat) / (idle - reuse) in median error: {cell(with_interval(errors, share))}")


if __name__ == "__main__":
    main()
