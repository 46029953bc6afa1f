"""What sharpening brings: how far beliefs lie from the truth, with it and without, on the point mass.

    .venv/bin/python benchmarks/sharp_beliefs.py [--inference goal-velocity] [--figure sharp.png]

Held-out tasks of the module's file; then goals and speeds that it was not trained on, and a minute at the goal. The
last column is the time of one decision for one body, with all that the agent does.
"""

import argparse
import time
from pathlib import Path

import equinox as eqx
import jax
import matplotlib.pyplot as plt
import numpy as np
from rich.console import Console
from rich.table import Table

from rebody.agents.agent import Observation
from rebody.agents.build import build_agent
from rebody.agents.clock import begin, decide
from rebody.agents.parts import Inference, load_inference
from rebody.agents.rollout import rollout_on_toy
from rebody.tasks.task_file import TaskSpec, active_tasks, read_tasks
from rebody.types import DECISION_DT, global_state

TASKS = Path(__file__).parent / "tasks"
SHORT, LONG, STILL = 200, 300, 600
"""Decisions of an episode."""
LAST = 20
WAYS = {"encoder": False, "sharpened": True}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inference", default="goal-velocity")
    parser.add_argument("--figure", type=Path)
    options = parser.parse_args()
    module, rng = load_inference(options.inference), np.random.default_rng(0)
    held_out = read_tasks(TASKS / f"{options.inference}-toy.json", module.contract.families)
    sets = {
        "held-out": (held_out, SHORT),
        "goals of 18 to 30 m": (drawn(rng, "goal", 18, 30), LONG),
        "goals of 0.5 to 2 m": (drawn(rng, "goal", 0.5, 2), SHORT),
        "speeds of 0.3 to 1 m/s": (drawn(rng, "velocity", 0.3, 1), SHORT),
        "a minute at the goal": (drawn(rng, "goal", 2, 15), STILL),
    }
    table = Table(title=f"{module.name}: |believed - true target|, last 2 s")
    columns = ("tasks", "belief", "median", "95th percentile", "family right after 10", "after 20", "ms a decision")
    for column in columns:
        table.add_column(column, justify="right")
    for name, (tasks, decisions) in sets.items():
        for way, sharpen in WAYS.items():
            right, apart = beliefs(module, tasks, decisions, sharpen)
            last = apart[-LAST:]
            said = [f"{np.median(last):.4f}", f"{np.percentile(last, 95):.4f}"]
            said += [f"{100 * right[i - 1].mean():.1f} %" for i in (10, 20)]
            table.add_row(name, way, *said, f"{1000 * decision_s(module, sharpen):.2f}" if name == "held-out" else "")
    Console().print(table)
    if options.figure:
        draw(module, held_out, options.figure)


def drawn(rng: np.random.Generator, family: str, low: float, high: float, number: int = 200) -> list[TaskSpec]:
    """Tasks on both sides."""
    targets = rng.choice([-1, 1], number) * rng.uniform(low, high, number)
    return [TaskSpec(family, (float(target),)) for target in targets]


def beliefs(module: Inference, tasks: list[TaskSpec], decisions: int, sharpen: bool):
    """Whether the family is right, and how far the believed target lies from the true one, [time, episode]."""
    families = module.contract.families
    active = active_tasks(tasks, families, decisions, DECISION_DT)
    agent = build_agent("reuse", module, horizon=1, sharpen=sharpen)
    which, target = agent.reader(rollout_on_toy(agent, module.toy, active, families).belief)
    right = np.asarray(which) == active.family
    # of another family there is no distance: as far off as nothing believed
    apart = np.where(right, np.abs(np.asarray(target) - active.target)[..., 0], np.abs(active.target[..., 0]))
    return right, apart


def decision_s(module: Inference, sharpen: bool, times: int = 200) -> float:
    """Seconds of one decision for one body."""
    agent, toy = build_agent("readout", module, sharpen=sharpen), module.toy
    state = toy.observe(toy.begin(global_state(x=np.zeros((), np.float32))))
    carry, _ = begin(agent, state)
    heard = Observation(state, np.asarray(-1.0, np.float32))
    for _ in range(2):
        carry, _ = decide(agent, carry, heard)
    begun = time.perf_counter()
    for _ in range(times):
        carry, _ = decide(agent, carry, heard)
    jax.block_until_ready(eqx.filter(carry, eqx.is_array))
    return (time.perf_counter() - begun) / times


def draw(module: Inference, tasks: list[TaskSpec], path: Path) -> None:
    """Median and 95th percentile of the distance over time, family by family."""
    families = dict.fromkeys(task.family for task in tasks)
    figure, axes = plt.subplots(1, len(families), figsize=(5 * len(families), 3.4), squeeze=False, layout="constrained")
    moments = DECISION_DT * np.arange(1, SHORT + 1)
    for axis, name in zip(axes[0], families, strict=True):
        own, family = [task for task in tasks if task.family == name], module.contract.families.named(name)
        for (way, sharpen), colour in zip(WAYS.items(), ("0.55", family.colour), strict=True):
            _, apart = beliefs(module, own, SHORT, sharpen)
            axis.plot(moments, np.median(apart, axis=1), color=colour, label=f"{way}, median")
            axis.plot(moments, np.percentile(apart, 95, axis=1), color=colour, ls=":", label="95th percentile")
        axis.set(yscale="log", ylim=(1e-5, 30), xlabel="time [s]", title=name)
        axis.set_ylabel(f"|believed - true target| [{family.unit}]")
    axes[0, 0].legend(frameon=False)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
