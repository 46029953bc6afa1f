"""The same hidden place, found by robots that walk by their makers' policies: paths, and what was believed on the way.

Needs the makers' files: export REBODY_MAKERS=FOLDER (docs/walking-robots.md). Nothing of ours was trained on any of the
robots. `--video` films them side by side, at twice the speed, with what each believes below.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image
from rich.console import Console

from rebody.agents.belief import Reading
from rebody.agents.parts import load_inference, load_tracker
from rebody.bodies import RobotSpec, load_robot
from rebody.bodies.camera import Camera
from rebody.evaluation.episode import EpisodeResult
from rebody.evaluation.listening import listen
from rebody.evaluation.trial import Trial
from rebody.report.plane import draw_map
from rebody.report.video import pixels_of, poles_of, record
from rebody.store.files import written_whole
from rebody.tasks import SHIPPED
from rebody.tasks.task_file import TaskSpec

WALKING = Path(__file__).parents[1] / "examples" / "walking"
NAMES = {"go1": "Unitree Go1", "t1": "Booster T1", "berkeley": "Berkeley Humanoid", "g1": "Unitree G1"}
ARRIVED = 0.25
ACROSS, UP = (-8.0, 4.0), (-4.0, 7.0)
"""Ends of all maps, so that they can be compared [m]."""
SIDE = 210
"""Width and height of a picture of a robot, and of a map below it, in pixels."""
EVERY, FRAME_MS = 2, 100
"""Decisions from one frame of the video to the next, and how long it is shown."""


@dataclass(frozen=True)
class Run:
    """One robot's episode."""

    title: str
    robot: RobotSpec
    episode: EpisodeResult
    poses: list[np.ndarray]
    readings: list[Reading]


def main() -> None:
    """Run, print, draw, film."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--place", type=float, nargs=2, default=(-4.0, 3.0))
    arguments.add_argument("--seconds", type=float, default=40.0)
    arguments.add_argument("--out", type=Path, default=Path("docs/walking/hidden-place.png"))
    arguments.add_argument("--video", type=Path, help="an animated picture, such as docs/walking/hidden-place.webp")
    arguments.add_argument("--filmed-s", type=float, default=16.0)
    said = arguments.parse_args()
    runs = [run_of(name, title, tuple(said.place), said.seconds) for name, title in NAMES.items()]
    figure, panels = plt.subplots(1, len(runs), figsize=(13, 3.8), layout="constrained", sharex=True, sharey=True)
    for panel, run in zip(panels, runs, strict=True):
        draw(panel, run, None)
        Console().print(f"{run.title}: {run.episode.final_error:.3f} m at the end, {arrival(run)}", highlight=False)
        panel.set_title(f"{run.title}: {run.episode.final_error:.3f} m")
    panels[0].legend(fontsize=8, frameon=False, loc="upper right")
    figure.savefig(said.out, dpi=130)
    plt.close(figure)
    if said.video is not None:
        first, *others = [Image.fromarray(frame) for frame in frames(runs, round(10 * said.filmed_s))]
        look = {"save_all": True, "append_images": others, "duration": FRAME_MS, "loop": 0, "quality": 55, "method": 4}
        with written_whole(said.video) as unfinished:
            first.save(unfinished, said.video.suffix[1:], **look)


def run_of(name: str, title: str, place: tuple[float, ...], seconds: float) -> Run:
    """One episode of `reuse`."""
    robot = load_robot(str(WALKING / f"{name}.toml"))
    trial = Trial(
        agent="reuse",
        inference=load_inference("plane"),
        families=SHIPPED,
        robot=robot,
        tracker=load_tracker("navigator"),
        slots_by="belief",
        sharpen=True,
        seconds=seconds,
    )
    episode, poses = record(trial, TaskSpec("place", place))
    readings = listen(trial.inference, episode, sharpen=True)
    assert readings is not None
    return Run(title, robot, episode, poses, readings)


def arrival(run: Run) -> str:
    """When it was first near enough."""
    near = run.episode.missed() < ARRIVED
    return f"within {ARRIVED} m after {np.argmax(near) / 10:.1f} s" if near.any() else "not met"


def draw(panel, run: Run, until: int | None) -> None:
    """The map, its ends alike for all."""
    draw_map(panel, run.episode, run.readings, until)
    panel.set(xlim=ACROSS, ylim=UP)


def frames(runs: list[Run], decisions: int) -> Iterator[np.ndarray]:
    """Robots above, maps below."""
    cameras = [Camera(r.robot.model, SIDE, SIDE, r.robot.root_body, around=True) for r in runs]
    for decision in range(0, decisions, EVERY):
        robots = [
            camera.picture(run.poses[decision * run.robot.steps_per_decision], poles_of(run.episode, decision))
            for camera, run in zip(cameras, runs, strict=True)
        ]
        size = (len(runs) * SIDE / 100, 1.15 * SIDE / 100)
        figure, panels = plt.subplots(1, len(runs), figsize=size, dpi=100, layout="constrained")
        for panel, run in zip(panels, runs, strict=True):
            draw(panel, run, decision + 1)
            panel.set(xlabel="", ylabel="", xticks=[], yticks=[])
            off = run.episode.missed()[decision]
            panel.set_title(f"{run.title}\n{(decision + 1) / 10:.1f} s, {off:.2f} m off", fontsize=7)
        yield np.concatenate([np.concatenate(robots, axis=1), pixels_of(figure)])
    for camera in cameras:
        camera.close()


if __name__ == "__main__":
    main()
