"""A film lasts as long as its episode and shows the robot."""

import os

import imageio_ffmpeg
import numpy as np
import pytest

from rebody.bodies.camera import Camera
from rebody.errors import RebodyError
from rebody.evaluation.evaluate import evaluate
from rebody.report import film, video
from rebody.report.video import FRAMES_PER_S, PLOT_HEIGHT, WIDTH
from rebody.tasks.task_file import TaskSpec

SECONDS = 3.0


@pytest.fixture(scope="module")
def opengl(trial):
    try:
        Camera(trial.robot.model, width=64, height=48).close()
    except RebodyError as error:
        pytest.skip(f"no OpenGL: {error}")


@pytest.fixture
def small(monkeypatch):
    """A small picture, and below it white: what is drawn there is the figures' business."""
    for name, size in (("WIDTH", 160), ("HEIGHT", 80), ("PLOT_HEIGHT", 64)):
        monkeypatch.setattr(video, name, size)
    white = np.full((64, 160, 3), 255, np.uint8)
    monkeypatch.setattr(video, "_plot", lambda episode, until: white)


@pytest.mark.usefixtures("opengl", "small")
def test_a_film_lasts_as_long_as_its_episode(trial, tmp_path):
    heard = []
    path = tmp_path / "new" / "film.mp4"
    episode = film(trial, TaskSpec("goal", (2.0,)), path, heard.append)
    assert episode.target == [2.0]
    assert len(episode.time_s) == 30
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(path)
    assert frames == SECONDS * FRAMES_PER_S
    assert seconds == pytest.approx(SECONDS, abs=0.1)
    assert heard[-1] == 1.0
    assert heard == sorted(heard)
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.usefixtures("opengl", "small")
def test_a_film_that_fails_leaves_the_old_one(trial, tmp_path):
    path = tmp_path / "film.mp4"
    path.write_bytes(b"old")

    def fail(done):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        film(trial, TaskSpec("goal", (2.0,)), path, fail)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_plot_below_fits_and_shows_how_far_it_is(trial):
    episode = evaluate(trial, [TaskSpec("goal", (2.0,))], 1).episodes[0]
    early, late = (video._plot(episode, until) for until in (2, 30))
    assert early.shape == late.shape == (PLOT_HEIGHT, WIDTH, 3)
    assert (early != late).any()


@pytest.mark.parametrize("program", ["nowhere/ffmpeg", "/bin/true", "/bin/false"])
def test_without_an_ffmpeg_that_runs_no_episode_is_run(program, trial, tmp_path, monkeypatch):
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", program)
    monkeypatch.setattr(video, "evaluate", None)
    with pytest.raises(RebodyError, match=r"videos need ffmpeg.*pip install --force-reinstall imageio-ffmpeg"):
        film(trial, TaskSpec("goal", (2.0,)), tmp_path / "film.mp4")


@pytest.mark.parametrize("error", [OSError("Broken pipe"), RuntimeError("No valid H.264 encoder"), IndexError()])
def test_an_ffmpeg_that_fails_is_one_message(error, trial, tmp_path, monkeypatch):
    def failing(*_, **__):
        yield
        raise error

    monkeypatch.setattr(video.imageio_ffmpeg, "write_frames", failing)
    monkeypatch.setattr(video, "_frames", lambda *_: iter([(1.0, np.zeros((8, 8, 3), np.uint8))]))
    with pytest.raises(RebodyError, match="ffmpeg could not write a video into"):
        film(trial, TaskSpec("goal", (2.0,)), tmp_path / "film.mp4")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("opengl", "small")
def test_a_film_that_was_not_finished_leaves_the_old_one(trial, tmp_path, monkeypatch):
    """On a disk that fills up with the last bytes, ffmpeg's writer ends as if all were well."""
    path, write_frames = tmp_path / "film.mp4", imageio_ffmpeg.write_frames
    path.write_bytes(b"old")

    def cut_short(unfinished, *size, **options):
        writer = write_frames(unfinished, *size, **options)
        writer.send(None)
        yield
        try:
            while True:
                writer.send((yield))
        finally:
            writer.close()
            os.truncate(unfinished, 2000)

    monkeypatch.setattr(imageio_ffmpeg, "write_frames", cut_short)
    with pytest.raises(RebodyError, match="Is the disk full"):
        film(trial, TaskSpec("goal", (2.0,)), path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]
