"""Module and policy reused on point masses that are not the one they learned on; nothing is trained anew.

    .venv/bin/python benchmarks/toy_to_toy.py [--out docs/position]

200 held-out goals each. Regret is against the policy that is told the goal (trained on the same toy as the module),
on the same point mass.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import equinox as eqx
import numpy as np

from agents import cell
from rebody.agents.parts import load_inference
from rebody.bodies.toys import Toy
from rebody.evaluation import evaluate
from rebody.evaluation.trial import Trial
from rebody.report.style import BELIEF, MOTION, figure
from rebody.tasks import SHIPPED
from rebody.tasks.task_file import read_tasks

TASKS = Path(__file__).parent / "tasks"
FACTORS = (0.25, 0.5, 1.0, 2.0, 4.0)
CHANGES = {"position": ("mass", "damping", "max_force"), "position-thesis": ("max_step",)}
FILES = {"position": "position-toy.json", "position-thesis": "position-thesis.json"}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("docs/position"))
    out = parser.parse_args().out
    print(
        "| module | point mass | median error [m] | 95th percentile [m] | return | regret |\n|---|---|---|---|---|---|"
    )
    measured = {}
    for module, changes in CHANGES.items():
        trial = Trial("reuse", load_inference(module), SHIPPED, None, None)
        specs = read_tasks(TASKS / FILES[module], SHIPPED)
        for change in changes:
            for factor in FACTORS:
                toy = scaled(trial.inference.toy, change, factor)
                results = evaluate(replace(trial, toy=toy), specs, 1)
                summary = results.summary
                goal, regret = summary["families"]["goal"], summary["regret"]
                returned = np.mean([episode.return_ for episode in results.episodes])
                measured[module, change, factor] = goal["median_error"]["value"], regret["value"]
                print(
                    f"| {module} | {change} x {factor:g} | {cell(goal['median_error'])} | {cell(goal['p95_error'])} "
                    f"| {returned:.1f} | {cell(regret)} |",
                    flush=True,
                )
    plot(measured, out / "toy_to_toy.png")


def scaled(toy: Toy, name: str, factor: float) -> Toy:
    return eqx.tree_at(lambda t: getattr(t, name), toy, factor * getattr(toy, name))


def plot(measured: dict, path: Path) -> None:
    with figure(path, 1, 2, size=(9.5, 3.8)) as (_, (errors, regrets)):
        for module, changes in CHANGES.items():
            for change in changes:
                error, regret = np.array([measured[module, change, factor] for factor in FACTORS]).T
                label = f"{change} ({module})"
                errors.plot(FACTORS, error, "o-", label=label)
                regrets.plot(FACTORS, regret, "o-", label=label)
        nominal_error, nominal_regret = measured["position", "mass", 1.0]
        errors.axhline(1.25 * nominal_error, color=BELIEF, ls="--", lw=1, label="125 % of the training toy's")
        regrets.axhline(nominal_regret + 0.1, color=MOTION, ls="--", lw=1, label="0.1 above the training toy's")
        errors.set(yscale="log", ylabel="median final error [m]")
        regrets.set(ylabel="regret")
        for axes in (errors, regrets):
            axes.set(xscale="log", xlabel="factor")
            axes.set_xticks(FACTORS, [f"{factor:g}" for factor in FACTORS])
            axes.minorticks_off()
            axes.legend(frameon=False, fontsize=7)


if __name__ == "__main__":
    main()
