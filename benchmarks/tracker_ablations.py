"""What each choice of a tracker's training brings: one short run per variant of the cheetah's, one table.

    .venv/bin/python benchmarks/tracker_ablations.py [--out runs/tracker-ablations] [--only NAME ...]

Every run gets a quarter of the iterations of the preset; one that is already there is not trained again. "One network
per slot" are three runs of one slot each, so three times the steps and updates. Errors are those that
the runs' cards give.
"""

import argparse
import json
from pathlib import Path

from ablations import train

from rebody.agents.parts import load_tracker
from rebody.bodies import load_robot
from rebody.training.tracker import tracker_preset
from rebody.training.tracker.report import measure

ROBOT = "cheetah"
SLOTS = ("goal", "velocity", "stand")
BUDGET = "--iterations 275 --sac.decay-updates 70000"
VARIANTS = {
    "as shipped": "",
    "curriculum of the thesis (6.4.1)": "--curriculum-iterations 90",
    "orders never change within 10 s": "--segment-s 10 10",
    "no command given afterwards": "--relabelled 0",
    "no subgoals of a toy": "--guided-share 0",
}
PER_SLOT = "one network per slot (5.6)"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    names = [*VARIANTS, PER_SLOT]
    parser.add_argument("--out", type=Path, default=Path("runs/tracker-ablations"))
    parser.add_argument("--only", nargs="*", default=names, choices=names)
    arguments = parser.parse_args()
    show({name: figures_of_variant(arguments.out, name) for name in arguments.only})


def figures_of_variant(out: Path, name: str) -> dict[str, float]:
    """Of one network, or each slot's of its own."""
    if name == PER_SLOT:
        return {figure: value for slot in SLOTS for figure, value in figures_of_slot(out, slot).items()}
    return figures_of(out / name.split(" (")[0].replace(" ", "-"), VARIANTS[name])


def figures_of_slot(out: Path, slot: str) -> dict[str, float]:
    """What a network reaches that knows that slot alone."""
    figures = figures_of(out / f"only-{slot}", f"--commands.only {slot}")
    return {name: value for name, value in figures.items() if name.startswith(slot)}


def figures_of(out: Path, flags: str) -> dict[str, float]:
    """Train a variant, or go on with it, and measure it."""
    train(["tracker", ROBOT, *BUDGET.split(), *flags.split()], out)
    minutes = json.loads((out / "config.json").read_text())["training"]["wall_s"] / 60
    spec = load_robot(ROBOT)
    return {"training [min]": minutes} | measure(load_tracker(str(out)).tracker, spec, tracker_preset(spec))


def show(rows: dict[str, dict[str, float]]) -> None:
    """A Markdown table, a row per variant."""
    shown = [f"{slot} {figure}" for slot in SLOTS for figure in ("median", "p95")] + ["zero speed", "training [min]"]
    print(f"| | {' | '.join(shown)} |\n|---|{'---|' * len(shown)}")
    for name, figures in rows.items():
        cells = [f"{figures[figure]:.3f}" if figure in figures else "" for figure in shown]
        print(f"| {name} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
