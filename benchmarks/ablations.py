"""What each choice of meta-training brings: one short run per variant of `goal-velocity`, one table.

    .venv/bin/python benchmarks/ablations.py [--out runs/ablations] [--only NAME ...]

Every variant gets the same number of iterations, about 5 minutes on 2 cores; one that is already there is not
trained again. Figures are those of benchmarks/inference.py, always on nominal toys and tasks that do not change but
for the rows that say so.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

from inference import figures_of, show

BUDGET = "--wander-iterations 15 --joint-iterations 25 --sac.decay-updates 16000"
CALM = "--randomisation.ripple-amplitude 0 --randomisation.lag 0 --randomisation.gain 1 1"
VARIANTS = {
    "as shipped": "",
    "labelled": "--inference.label-weight 0.05",
    "one Gaussian": "--prior gaussian",
    "fixed K = 4": "--mixture.components 4",
    "latent not split": "--inference.kinds 0",
    "window 16": "--inference.window 16",
    "window 64": "--inference.window 64",
    "carried state": "--inference.window None --inference.batch-size 8",
    "no changes of the task": "--switch-share 0",
    "not randomised": CALM,
    "observation noise 0.1": f"{CALM} --observation-noise 0.1",
    "observation noise 0.2": f"{CALM} --observation-noise 0.2",
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("runs/ablations"))
    parser.add_argument("--only", nargs="*", default=list(VARIANTS), choices=list(VARIANTS))
    arguments = parser.parse_args()
    rows = {}
    for name in arguments.only:
        out = arguments.out / name.replace(" ", "-").replace("=", "")
        train(["inference", "goal-velocity", *BUDGET.split(), *VARIANTS[name].split()], out)
        minutes = json.loads((out / "config.json").read_text())["training"]["wall_s"] / 60
        rows[name] = {"training [min]": minutes} | figures_of(str(out))
    show(rows)


def train(arguments: list[str], out: Path) -> None:
    """`rebody train` with these arguments, or go on with it; nothing if it is done."""
    if (out / "card.md").exists():
        return
    rebody = Path(sys.executable).with_name("rebody")
    command = [rebody, "train", *arguments, "--out", out]
    if (out / "checkpoint").exists():
        command.append("--resume")
    subprocess.run([str(part) for part in command], check=True)


if __name__ == "__main__":
    main()
