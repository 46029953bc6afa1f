"""A video of one episode: the robot above, what it believes below."""

import io
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import imageio_ffmpeg
import matplotlib.pyplot as plt
import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image

from rebody.bodies import RobotBatch, RobotSpec
from rebody.bodies.camera import Camera
from rebody.evaluation.evaluate import Trial, evaluate
from rebody.evaluation.results import EpisodeResult
from rebody.report.figures import draw_progress
from rebody.tasks.task_file import TaskSpec

WIDTH, HEIGHT, PLOT_HEIGHT = 640, 320, 240
FRAMES_PER_S = 20


def film(trial: Trial, spec: TaskSpec, path: Path, on_progress: Callable[[float], None] | None = None) -> EpisodeResult:
    """Run one episode and write it as an MP4 in real time; returns the episode.

    `on_progress` hears the finished share. RebodyError where nothing can be drawn.
    """
    assert trial.robot is not None
    poses: list[Float[np.ndarray, " nq"]] = []

    def remember(batch: RobotBatch, _: object) -> None:
        poses.append(batch.qpos[0].copy())

    episode = evaluate(replace(trial, on_frame=remember), [spec], 1).episodes[0]
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.stem}.new{path.suffix}")
    try:
        size = (WIDTH, HEIGHT + PLOT_HEIGHT)
        writer = imageio_ffmpeg.write_frames(str(unfinished), size, fps=FRAMES_PER_S, macro_block_size=1)
        writer.send(None)  # starts the generator
        for done, frame in _frames(trial.robot, poses, episode):
            writer.send(frame)
            if on_progress is not None:
                on_progress(done)
        writer.close()
        os.replace(unfinished, path)
    finally:
        unfinished.unlink(missing_ok=True)
    return episode


def _frames(spec: RobotSpec, poses: list[Float[np.ndarray, " nq"]], episode: EpisodeResult):
    """Share done and picture of each frame."""
    every = max(1, round(1 / (FRAMES_PER_S * spec.control_dt)))
    camera = Camera(spec.model, WIDTH, HEIGHT)
    try:
        plot = None
        for step in range(0, len(poses), every):
            decision = step // spec.steps_per_decision
            if step % spec.steps_per_decision == 0 or plot is None:
                plot = _plot(episode, decision + 1)
            yield (step + 1) / len(poses), np.concatenate([camera.picture(poses[step]), plot])
    finally:
        camera.close()


def _plot(episode: EpisodeResult, until: int) -> UInt8[np.ndarray, "height width 3"]:
    drawing, axes = plt.subplots(figsize=(WIDTH / 100, PLOT_HEIGHT / 100), layout="constrained")
    draw_progress(axes, episode, until)
    buffer = io.BytesIO()
    drawing.savefig(buffer, dpi=100)
    plt.close(drawing)
    return np.asarray(Image.open(buffer).convert("RGB"))
