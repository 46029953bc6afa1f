"""Pictures of the plane: a map, velocities, headings on a circle."""

import warnings
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.patches import Ellipse
from tests.report.test_figures import assert_drawn, results_of
from tests.walking import write_cart

from rebody.cli.trial import TrialOptions
from rebody.evaluation.evaluate import evaluate
from rebody.evaluation.listening import listen
from rebody.report import film, plot_episode, plot_transfer
from rebody.report.figures import draw_progress
from rebody.report.plane import draw_map, headings_of, path_of
from rebody.tasks.task_file import TaskSpec

pytest.importorskip("onnxruntime")
pytest.importorskip("onnx")
TASKS = [TaskSpec("place", (2.0, -1.0)), TaskSpec("velocity_xy", (0.0, 0.6)), TaskSpec("heading", (2.5,))]


@pytest.fixture(scope="module")
def trial(tmp_path_factory):
    robot = str(write_cart(tmp_path_factory.mktemp("cart")))
    return TrialOptions(robot=robot, inference="plane", seconds=4.0).load()


@pytest.fixture(scope="module")
def results(trial):
    return evaluate(trial, TASKS, 1)


@pytest.fixture(scope="module")
def readings(trial, results):
    return [listen(trial.inference, episode, trial.sharpens) for episode in results.episodes]


def test_who_listens_again_believes_the_same(results, readings):
    """But for what results are rounded to."""
    for episode, heard in zip(results.episodes, readings, strict=True):
        assert [reading.family for reading in heard[20:]] == episode.inferred_family[20:]
        np.testing.assert_allclose(heard[-1].target, episode.inferred_target[-1], atol=0.02)


def test_a_result_that_does_not_tell_all_that_the_module_sees_is_not_listened_to(trial, results):
    episode = results.episodes[0]
    less = {name: series for name, series in episode.quantities.items() if name != "yaw"}
    assert listen(trial.inference, replace(episode, quantities=less), True) is None
    assert path_of(replace(episode, quantities={})) is None


@pytest.mark.parametrize("i", range(len(TASKS)))
def test_an_episode(i, results, readings, tmp_path):
    for name, heard in (("with", readings[i]), ("without", None)):
        plot_episode(results.episodes[i], tmp_path / f"{name}.png", heard)
        assert_drawn(tmp_path / f"{name}.png")


def test_many_episodes(results, tmp_path):
    plot_transfer(results, results, results, tmp_path / "transfer.png")
    assert_drawn(tmp_path / "transfer.png")


@pytest.fixture
def axes():
    """Closed also when a test fails, so that no other test finds it."""
    drawing, axes = plt.subplots()
    yield axes
    plt.close(drawing)


def test_the_map_has_the_path_so_far_and_an_ellipse(axes, results, readings):
    episode = results.episodes[0]
    until = 1 + max(i for i, family in enumerate(episode.inferred_family) if family == "place")
    draw_map(axes, episode, readings[0], until=until)
    named = {line.get_label(): line for line in axes.lines}
    np.testing.assert_allclose(named["robot"].get_xydata(), path_of(episode)[:until])
    np.testing.assert_allclose(named["hidden target"].get_xydata(), [[2.0, -1.0]])
    assert len([each for each in axes.patches if isinstance(each, Ellipse)]) == 1
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    assert right - left == pytest.approx(top - bottom)


def test_time_runs_outwards_on_a_circle_of_headings(axes, results):
    episode = results.episodes[2]
    draw_progress(axes, episode, episode.last_family)
    (robot,) = [line for line in axes.lines if line.get_label() == "robot"]
    x, y = robot.get_xydata().T
    assert (np.diff(np.hypot(x, y)) > 0).all()
    off = np.arctan2(y, x) - headings_of(episode)[:, 0]
    np.testing.assert_allclose(np.cos(off), 1.0, atol=1e-9)


def test_a_film_has_a_map_beside_the_robot(trial, tmp_path, monkeypatch):
    import imageio_ffmpeg

    from rebody.bodies.camera import Camera
    from rebody.errors import RebodyError
    from rebody.report import video

    try:
        Camera(trial.robot.model, width=64, height=48).close()
    except RebodyError as error:
        pytest.skip(f"no OpenGL: {error}")
    monkeypatch.setattr(video, "MAP", 96)
    monkeypatch.setattr(video, "map_picture", lambda *_: np.full((96, 96, 3), 255, np.uint8))
    film(replace(trial, seconds=3.0), TASKS[0], tmp_path / "film.mp4")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # JAX warns of any fork; this one at once becomes ffmpeg
        reader = imageio_ffmpeg.read_frames(str(tmp_path / "film.mp4"))
        assert next(reader)["size"] == (192, 96)
        reader.close()


def test_results_of_other_bodies_have_no_map():
    from tests.report.test_figures import episode_of

    assert path_of(results_of(episode_of(2.0)).episodes[0]) is None
