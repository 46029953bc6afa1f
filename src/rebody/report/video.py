"""A video of one episode: the robot above, what it believes below; in the plane a map beside the robot."""

import subprocess
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import imageio_ffmpeg
import matplotlib.pyplot as plt
import numpy as np
from jaxtyping import Float, UInt8
from matplotlib.figure import Figure

from rebody.agents.belief import Reading
from rebody.bodies import RobotSpec, Simulation
from rebody.bodies.camera import Camera, Colour, Pole
from rebody.errors import RebodyError
from rebody.evaluation.episode import EpisodeResult
from rebody.evaluation.evaluate import evaluate
from rebody.evaluation.listening import listen_beside
from rebody.evaluation.trial import Trial
from rebody.report.figures import draw_progress
from rebody.report.plane import draw_map, path_of
from rebody.store.files import written_whole
from rebody.tasks.task_file import TaskSpec
from rebody.types import DECISION_DT

WIDTH, HEIGHT, PLOT_HEIGHT = 640, 320, 240
MAP = 480
"""Width and height of robot and map, where there is a plane."""
FRAMES_PER_S = 20
MENDING_FFMPEG = (
    "Install it anew (pip install --force-reinstall imageio-ffmpeg), or name one that encodes H.264 in "
    "IMAGEIO_FFMPEG_EXE."
)
THIN_M = 0.012
"""Radius of a pole where a robot walks up to it."""
TRUTH_POLE, BELIEF_POLE = (0.1, 0.1, 0.1, 1.0), (0.82, 0.29, 0.36, 0.8)


class Look(NamedTuple):
    """How a frame is put together."""

    width: int
    height: int
    """Of the robot's picture [pixels]."""
    around: bool
    """Whether more of the floor is shown."""
    plot: Callable[[int], UInt8[np.ndarray, "height width 3"]]
    """What is believed up to a decision."""
    axis: int
    """Below the robot (0) or beside it (1)."""


def film(trial: Trial, spec: TaskSpec, path: Path, on_progress: Callable[[float], None] | None = None) -> EpisodeResult:
    """Run one episode and write it as an MP4 in real time; returns the episode.

    `on_progress` hears the finished share. RebodyError where nothing can be drawn or written.
    """
    assert trial.robot is not None
    _check_ffmpeg()
    episode, poses = record(trial, spec)
    if path_of(episode) is None:
        look = Look(WIDTH, HEIGHT, False, lambda until: _plot(episode, until), 0)
    else:
        readings = listen_beside(trial, episode)
        look = Look(MAP, MAP, True, lambda until: map_picture(episode, readings, until, MAP), 1)
    frames = _frames(trial.robot, poses, episode, look)
    first = next(frames)  # before ffmpeg, which complains where it gets none
    with written_whole(path) as unfinished, _ffmpeg(unfinished, first[1]) as write:
        for done, frame in chain([first], frames):
            write(frame)
            if on_progress is not None:
                on_progress(done)
    return episode


def record(trial: Trial, spec: TaskSpec) -> tuple[EpisodeResult, list[Float[np.ndarray, " nq"]]]:
    """An episode, and the joint positions for a picture after each of its control steps."""
    poses: list[Float[np.ndarray, " nq"]] = []

    def remember(body: Simulation, _: object) -> None:
        poses.append(body.picture_pose()[0])

    return evaluate(replace(trial, on_frame=remember), [spec], 1).episodes[0], poses


def _check_ffmpeg() -> None:
    """RebodyError, before an episode is run for nothing, where there is no ffmpeg that runs."""
    try:
        version = imageio_ffmpeg.get_ffmpeg_version()
    except (RuntimeError, OSError, subprocess.CalledProcessError):
        version = ""
    if not version:  # another program has none to tell
        raise RebodyError(f"videos need ffmpeg, and there is none that runs. {MENDING_FFMPEG}")


@contextmanager
def _ffmpeg(path: Path, like: UInt8[np.ndarray, "height width 3"]) -> Iterator[Callable[[np.ndarray | None], None]]:
    """While inside, a function that takes frames of that size; RebodyError where ffmpeg fails."""
    size = (like.shape[1], like.shape[0])
    writer = imageio_ffmpeg.write_frames(str(path), size, fps=FRAMES_PER_S, macro_block_size=1)

    failed = f"ffmpeg could not write a video into {path.parent}. Is the disk full? {MENDING_FFMPEG}"

    def write(frame: np.ndarray | None) -> None:
        try:
            writer.send(frame)
        except (OSError, RuntimeError, LookupError) as error:  # it ended, or cannot encode
            raise RebodyError(failed) from error

    try:
        with warnings.catch_warnings():
            # JAX warns of any fork; this one at once becomes ffmpeg
            warnings.filterwarnings("ignore", message=r"os\.fork\(\) was called")
            write(None)  # starts ffmpeg
        yield write
    finally:
        writer.close()
    try:
        imageio_ffmpeg.count_frames_and_secs(str(path))
    except RuntimeError as error:  # of a file that it could not finish, imageio-ffmpeg says nothing
        raise RebodyError(failed) from error


def _frames(spec: RobotSpec, poses: list[Float[np.ndarray, " nq"]], episode: EpisodeResult, look: Look):
    """Share done and picture of each frame."""
    every = max(1, round(1 / (FRAMES_PER_S * spec.control_dt)))
    camera = Camera(spec.model, look.width, look.height, spec.root_body, look.around)
    try:
        plot = None
        for step in range(0, len(poses), every):
            decision = step // spec.steps_per_decision
            if step % spec.steps_per_decision == 0 or plot is None:
                plot = look.plot(decision + 1)
            picture = camera.picture(poses[step], poles_of(episode, decision))
            yield (step + 1) / len(poses), np.concatenate([picture, plot], axis=look.axis)
    finally:
        camera.close()


def poles_of(episode: EpisodeResult, decision: int) -> list[Pole]:
    """Where the hidden place is, and where it is believed to be after the last finished decision."""
    hidden = _pole(episode, episode.active_family[decision], episode.active_target[decision], TRUTH_POLE)
    before = decision - 1
    if not decision or not hidden:
        return hidden
    return hidden + _pole(episode, episode.inferred_family[before], episode.inferred_target[before], BELIEF_POLE)


def _pole(episode: EpisodeResult, family: str, target: list[float], colour: Colour) -> list[Pole]:
    """Where a target is; nothing where it says nothing of that."""
    asked = dict(zip(episode.families.named(family).quantity.components, target, strict=True))
    if "x" not in asked:
        return []
    return [Pole(asked["x"], colour, asked["y"], THIN_M) if "y" in asked else Pole(asked["x"], colour)]


def _plot(episode: EpisodeResult, until: int) -> UInt8[np.ndarray, "height width 3"]:
    size, families = (WIDTH / 100, PLOT_HEIGHT / 100), episode.asked
    drawing, panels = plt.subplots(1, len(families), figsize=size, dpi=100, layout="constrained", squeeze=False)
    for axes, family in zip(panels[0], families, strict=True):
        draw_progress(axes, episode, family, until)
    if len(families) > 1:
        panels[0, 1].get_legend().remove()  # one is enough, and there is no room for two
    return pixels_of(drawing)


def map_picture(
    episode: EpisodeResult, readings: Sequence[Reading] | None, until: int, size: int
) -> UInt8[np.ndarray, "size size 3"]:
    """The map up to a decision, so many pixels wide."""
    drawing, axes = plt.subplots(figsize=(size / 100, size / 100), dpi=100, layout="constrained")
    draw_map(axes, episode, readings, until)
    axes.set_title(f"{until * DECISION_DT:.1f} s", fontsize=9)
    axes.legend(loc="upper right", fontsize=8)
    return pixels_of(drawing)


def pixels_of(drawing: Figure) -> UInt8[np.ndarray, "height width 3"]:
    """What is drawn, which is closed."""
    drawing.canvas.draw()
    pixels = np.array(drawing.canvas.buffer_rgba())[..., :3]  # pyright: ignore[reportAttributeAccessIssue] (Agg)
    plt.close(drawing)
    return pixels
