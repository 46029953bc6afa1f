"""What trackers can be told: the error of every speed, pitch and jump, inside and outside of what they trained for.

    .venv/bin/python benchmarks/reach.py [--trackers tracker-cheetah ...] [--out runs/reach.png]

Told a speed, a pitch or a jump for 10 s, 8 starts each. Held is what is missed by no more than the family's tolerance
(0.25 m/s, 0.2 rad, jumps 0.4 m/s; median of the starts).
"""

import argparse
from pathlib import Path

import numpy as np

from rebody.agents.controller import TrackerController
from rebody.agents.parts import LoadedTracker, load_tracker
from rebody.agents.rollout import follow
from rebody.bodies import load_robot
from rebody.report.style import figure
from rebody.tasks import SHIPPED
from rebody.tasks.figures import final_error
from rebody.training.tracker.report import run_robots
from rebody.types import Subgoal, Task

TOLD = {
    "velocity": np.arange(-4.0, 4.05, 0.1),
    "stand": np.arange(-1.5, 1.55, 0.05),
    "jump": np.arange(0.2, 5.05, 0.1),
}
STARTS = 8

Curve = dict[float, float]
"""What was told -> median error."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trackers", nargs="*", default=["tracker-cheetah", "tracker-hopper", "tracker-walker"])
    parser.add_argument("--out", type=Path, default=Path("runs/reach.png"))
    arguments = parser.parse_args()
    found = {name: curves_of(load_tracker(name)) for name in arguments.trackers}
    show(found)
    draw(found, arguments.out)


def curves_of(loaded: LoadedTracker) -> dict[str, Curve]:
    """Of each slot but goals: a far goal is a speed."""
    spec, tracker = load_robot(loaded.robot), loaded.tracker
    controller, curves = TrackerController(tracker, goal_ahead=spec.goal_ahead), {}
    for slot, values in TOLD.items():
        if slot not in tracker.families:
            continue
        told = np.repeat(values, STARTS).astype(np.float32)
        command = Subgoal(np.full(len(told), tracker.families.index(slot), np.int32), told[:, None])
        states, _ = run_robots(spec, len(told), lambda batch, command=command: follow(controller, batch, command))
        errors = final_error(tracker.families, Task(command.slot, command.value), states).reshape(-1, STARTS)
        curves[slot] = dict(zip(values.round(2).tolist(), np.median(errors, axis=1).tolist(), strict=True))
    return curves


def held(curve: Curve, tolerance: float) -> list[tuple[float, float]]:
    """Ranges without an error beyond the tolerance."""
    values, is_held = list(curve), [error <= tolerance for error in curve.values()]
    begins = [i for i, now in enumerate(is_held) if now and not (i and is_held[i - 1])]
    ends = [i for i, now in enumerate(is_held) if now and not (i + 1 < len(values) and is_held[i + 1])]
    return [(values[i], values[j]) for i, j in zip(begins, ends, strict=True)]


def show(found: dict[str, dict[str, Curve]]) -> None:
    """A Markdown table: what is held beside what was trained for."""
    print("| tracker | slot | trained for | held within the tolerance |\n|---|---|---|---|")
    for name, curves in found.items():
        families = load_tracker(name).tracker.families
        for slot, curve in curves.items():
            family = families.named(slot)
            trained = family.range.low[0], family.range.high[0]
            ranges = ", ".join(f"{low:g} to {high:g}" for low, high in held(curve, family.tolerance))
            print(f"| {name} | {family.name} [{family.unit}] | {trained[0]:g} to {trained[1]:g} | {ranges} |")


def draw(found: dict[str, dict[str, Curve]], out: Path) -> None:
    """A panel per slot that a tracker has, a line per tracker."""
    slots = [slot for slot in TOLD if any(slot in curves for curves in found.values())]
    with figure(out, 1, len(slots), size=(5.5 * len(slots), 4.2)) as (_, panels):
        for axes, slot in zip(np.atleast_1d(panels), slots, strict=True):
            family = SHIPPED.named(slot)
            for name, curves in found.items():
                if slot in curves:
                    axes.plot(list(curves[slot]), list(curves[slot].values()), ".-", ms=4, label=name)
            axes.axhline(family.tolerance, color="#999999", lw=0.8, ls=":")
            axes.set(
                xlabel=f"told {family.name} [{family.unit}]", ylabel=f"final error [{family.unit}]", ylim=(0, None)
            )
            axes.legend(frameon=False, fontsize=8)


if __name__ == "__main__":
    main()
