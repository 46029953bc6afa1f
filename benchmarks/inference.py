"""What an inference module is worth on the toy: precision, return, sharpness, clusters, changes of the task.

    .venv/bin/python benchmarks/inference.py goal-velocity runs/goal-velocity-seed-1 ... [--json OUT]

An artifact is a shipped name or a folder; its own card says which preset made it. 500 held-out tasks, 20 s each.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path

from rebody.agents.parts import load_inference
from rebody.store import load_artifact
from rebody.training.inference import PRESETS
from rebody.training.inference.measure import measure_in_depth

HELD_OUT = 500


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("artifacts", nargs="+")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    rows = {name: figures_of(name) for name in arguments.artifacts}
    show(rows)
    if arguments.json:
        arguments.json.write_text(json.dumps(rows, indent=1))


def figures_of(name: str) -> dict[str, float]:
    """The figures of one artifact on the tasks of the preset that made it."""
    module = load_inference(name)
    preset = PRESETS[load_artifact(name, "inference").card.splitlines()[0].split()[-1]]()
    encoder = module.parts.module.encoder  # a variant may have another latent than its preset
    inference = replace(preset.inference, latent=encoder.latent, kinds=encoder.kinds, window=encoder.window)
    prior = "gaussian" if module.parts.mixture is None else "mixture"
    return measure_in_depth(module.parts, module.toy, replace(preset, inference=inference, prior=prior), HELD_OUT)


def show(rows: dict[str, dict[str, float]]) -> None:
    """A Markdown table, a column per artifact."""
    print(f"| {HELD_OUT} held-out tasks | {' | '.join(rows)} |\n|---|{'---|' * len(rows)}")
    for figure in dict.fromkeys(name for figures in rows.values() for name in figures):
        cells = [f"{figures[figure]:.4g}" if figure in figures else "" for figures in rows.values()]
        print(f"| {figure} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
