"""The same hidden place, found by robots that walk by their makers' policies: paths, and what was believed on the way.

Needs the makers' files: export REBODY_MAKERS=FOLDER (docs/walking-robots.md). Nothing of ours was trained on any of the
robots.
"""

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from rich.console import Console

from rebody.agents.parts import load_inference, load_tracker
from rebody.bodies import load_robot
from rebody.evaluation.evaluate import evaluate
from rebody.evaluation.trial import Trial
from rebody.tasks import SHIPPED
from rebody.tasks.task_file import TaskSpec

WALKING = Path(__file__).parents[1] / "examples" / "walking"
NAMES = {"go1": "Unitree Go1", "t1": "Booster T1", "berkeley": "Berkeley Humanoid", "g1": "Unitree G1"}
ARRIVED = 0.25
FIRST = 40
"""Decisions whose beliefs are drawn."""


def main() -> None:
    """Run, print, draw."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--place", type=float, nargs=2, default=(-4.0, 3.0))
    arguments.add_argument("--seconds", type=float, default=40.0)
    arguments.add_argument("--out", type=Path, default=Path("docs/walking/hidden-place.png"))
    said = arguments.parse_args()
    figure, panels = plt.subplots(1, len(NAMES), figsize=(13, 3.8), layout="constrained", sharex=True, sharey=True)
    for panel, (name, title) in zip(panels, NAMES.items(), strict=True):
        episode = episode_of(name, tuple(said.place), said.seconds)
        draw(panel, episode, title)
        far = np.linalg.norm(np.array(episode.quantities["position_xy"]) - said.place, axis=1)
        arrived = (
            f"within {ARRIVED} m after {np.argmax(far < ARRIVED) / 10:.1f} s" if (far < ARRIVED).any() else "not met"
        )
        Console().print(f"{title}: {episode.final_error:.3f} m at the end, {arrived}", highlight=False)
    panels[0].set_ylabel("y [m]")
    panels[0].legend(fontsize=8, frameon=False, loc="upper right")
    figure.savefig(said.out, dpi=130)


def episode_of(name: str, place: tuple[float, ...], seconds: float):
    """One episode of `reuse`."""
    trial = Trial(
        agent="reuse",
        inference=load_inference("plane"),
        families=SHIPPED,
        robot=load_robot(str(WALKING / f"{name}.toml")),
        tracker=load_tracker("navigator"),
        slots_by="belief",
        sharpen=True,
        seconds=seconds,
    )
    return evaluate(trial, [TaskSpec("place", place)], seeds=1).episodes[0]


def draw(panel, episode, title: str) -> None:
    """The path, the hidden place, and the places believed while it was found out."""
    path = np.array(episode.quantities["position_xy"])
    heard = list(zip(episode.inferred_family, episode.inferred_target, strict=True))[:FIRST]
    places = np.array([target for family, target in heard if family == "place"])
    panel.plot(*path.T, color="#2b6f9e", label="path")
    panel.scatter(
        *places.T,
        c=np.arange(len(places)),
        cmap="Reds_r",
        s=8,
        zorder=1,
        label="believed in the first 4 s, early is dark",
    )
    panel.plot(0, 0, "o", color="0.5", markersize=5)
    panel.plot(*episode.target, "*", color="#222222", markersize=13, label="hidden place")
    panel.set(title=f"{title}: {episode.final_error:.3f} m", xlabel="x [m]", xlim=(-8, 4), ylim=(-4, 7), aspect="equal")


if __name__ == "__main__":
    main()
