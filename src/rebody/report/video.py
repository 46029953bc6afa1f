"""A video of one episode: the robot above, what it believes below."""

import subprocess
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain
from pathlib import Path

import imageio_ffmpeg
import matplotlib.pyplot as plt
import numpy as np
from jaxtyping import Float, UInt8

from rebody.bodies import RobotSpec, Simulation
from rebody.bodies.camera import Camera, Pole
from rebody.errors import RebodyError
from rebody.evaluation.episode import EpisodeResult
from rebody.evaluation.evaluate import evaluate
from rebody.evaluation.trial import Trial
from rebody.report.figures import draw_progress
from rebody.store.files import written_whole
from rebody.tasks.task_file import TaskSpec

WIDTH, HEIGHT, PLOT_HEIGHT = 640, 320, 240
FRAMES_PER_S = 20
MENDING_FFMPEG = (
    "Install it anew (pip install --force-reinstall imageio-ffmpeg), or name one that encodes H.264 in "
    "IMAGEIO_FFMPEG_EXE."
)
TRUTH_POLE, BELIEF_POLE = (0.1, 0.1, 0.1, 1.0), (0.82, 0.29, 0.36, 0.8)


def film(trial: Trial, spec: TaskSpec, path: Path, on_progress: Callable[[float], None] | None = None) -> EpisodeResult:
    """Run one episode and write it as an MP4 in real time; returns the episode.

    `on_progress` hears the finished share. RebodyError where nothing can be drawn or written.
    """
    assert trial.robot is not None
    _check_ffmpeg()
    poses: list[Float[np.ndarray, " nq"]] = []

    def remember(body: Simulation, _: object) -> None:
        poses.append(body.picture_pose()[0])

    episode = evaluate(replace(trial, on_frame=remember), [spec], 1).episodes[0]
    frames = _frames(trial.robot, poses, episode)
    first = next(frames)  # before ffmpeg, which complains where it gets none
    with written_whole(path) as unfinished, _ffmpeg(unfinished) as write:
        for done, frame in chain([first], frames):
            write(frame)
            if on_progress is not None:
                on_progress(done)
    return episode


def _check_ffmpeg() -> None:
    """RebodyError, before an episode is run for nothing, where there is no ffmpeg that runs."""
    try:
        version = imageio_ffmpeg.get_ffmpeg_version()
    except (RuntimeError, OSError, subprocess.CalledProcessError):
        version = ""
    if not version:  # another program has none to tell
        raise RebodyError(f"videos need ffmpeg, and there is none that runs. {MENDING_FFMPEG}")


@contextmanager
def _ffmpeg(path: Path) -> Iterator[Callable[[np.ndarray | None], None]]:
    """While inside, a function that takes the frames; RebodyError where ffmpeg fails."""
    size = (WIDTH, HEIGHT + PLOT_HEIGHT)
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


def _frames(spec: RobotSpec, poses: list[Float[np.ndarray, " nq"]], episode: EpisodeResult):
    """Share done and picture of each frame."""
    every = max(1, round(1 / (FRAMES_PER_S * spec.control_dt)))
    camera = Camera(spec.model, WIDTH, HEIGHT, spec.root_body)
    try:
        plot = None
        for step in range(0, len(poses), every):
            decision = step // spec.steps_per_decision
            if step % spec.steps_per_decision == 0 or plot is None:
                plot = _plot(episode, decision + 1)
            picture = camera.picture(poses[step], _poles(episode, decision))
            yield (step + 1) / len(poses), np.concatenate([picture, plot])
    finally:
        camera.close()


def _poles(episode: EpisodeResult, decision: int) -> list[Pole]:
    """Where the hidden place is, and where it is believed to be after the last finished decision."""
    hidden = _x_of(episode, episode.active_family[decision], episode.active_target[decision])
    if hidden is None:
        return []
    before = max(decision - 1, 0)
    believed = _x_of(episode, episode.inferred_family[before], episode.inferred_target[before]) if decision else None
    return [Pole(hidden, TRUTH_POLE), *([] if believed is None else [Pole(believed, BELIEF_POLE)])]


def _x_of(episode: EpisodeResult, family: str, target: list[float]) -> float | None:
    """Where along x a target is; None where it says nothing of that."""
    names = episode.families.named(family).quantity.components
    return target[names.index("x")] if "x" in names else None


def _plot(episode: EpisodeResult, until: int) -> UInt8[np.ndarray, "height width 3"]:
    size, families = (WIDTH / 100, PLOT_HEIGHT / 100), episode.asked
    drawing, panels = plt.subplots(1, len(families), figsize=size, dpi=100, layout="constrained", squeeze=False)
    for axes, family in zip(panels[0], families, strict=True):
        draw_progress(axes, episode, family, until)
    if len(families) > 1:
        panels[0, 1].get_legend().remove()  # one is enough, and there is no room for two
    drawing.canvas.draw()
    pixels = np.array(drawing.canvas.buffer_rgba())[..., :3]  # pyright: ignore[reportAttributeAccessIssue] (Agg)
    plt.close(drawing)
    return pixels
