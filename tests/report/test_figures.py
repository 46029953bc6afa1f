"""Figures are written whole, for one episode as for many."""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from PIL import Image

from rebody.evaluation.episode import EpisodeResult
from rebody.evaluation.results import Results
from rebody.ranges import Box
from rebody.report import plot_episode, plot_transfer
from rebody.report.figures import draw_progress
from rebody.report.style import figure
from rebody.tasks import SHIPPED, Family, FamilySet, Quantity

TIME = 30


def own(name, *components):
    """A family of vectors."""
    targets = (Box((-9.0,) * len(components), (9.0,) * len(components)),)
    return Family(name, Quantity(name, components, "m", name), targets, floor=0.5, tolerance=0.3)


FAMILIES = SHIPPED.beside(FamilySet((own("spot", "x", "y"), own("lean", "x", "pitch", "vz"))))


def episode_of(target, family="goal", error=0.1):
    """Of a number, or of a vector."""
    time, target = 0.1 * np.arange(1, TIME + 1), np.atleast_1d(target).astype(float).tolist()
    reached = np.array(target) * (1 - np.exp(-time))[:, None]
    x, vectors = reached[:, 0], reached.tolist()
    numbers = {"x": x.tolist(), "vx": np.gradient(x, time).tolist(), "pitch": [0.0] * TIME, "vz": [0.0] * TIME}
    return EpisodeResult(
        families=FAMILIES, family=family, target=target, seed=0, switch=None, time_s=time.tolist(),
        quantities=numbers | ({family: vectors} if len(target) > 1 else {}),
        reward=(-np.abs(x - target[0])).tolist(), active_family=[family] * TIME, active_target=[target] * TIME,
        inferred_family=[family] * TIME, inferred_target=vectors, cluster=[0] * TIME,
        latent=np.stack([x, -x], axis=-1).tolist(), subgoal_family=[family] * TIME, subgoal=vectors, fell=False,
        return_=-3.0, oracle_return=-2.0, idle_return=-4.0,
        final_error=error, final_squared_error=error**2, ripple_m_s=0.0,
    )  # fmt: skip


def results_of(*episodes):
    return Results("cheetah", "reuse", "tiny", "tiny-tracker", 0.05, 1, 15, False, {}, FAMILIES, list(episodes))


def assert_drawn(path):
    with Image.open(path) as picture:
        assert picture.format == "PNG"
        pixels = np.asarray(picture.convert("L"))
    assert min(pixels.shape) > 300
    assert (pixels < 128).mean() > 0.001  # there is something on it
    assert not plt.get_fignums()  # nothing stays open


@pytest.mark.parametrize(
    "episodes",
    [
        [episode_of(target) for target in (-9.0, -1.0, 4.0)],
        [episode_of(4.0)],
        [episode_of(0.0, error=0.0)],
        [episode_of(1.5, "velocity"), episode_of(-1.0, "velocity")],
        [episode_of(4.0), episode_of(-1.5, "velocity"), episode_of(0.8, "stand")],
        [episode_of([4.0, -2.0], "spot"), episode_of([-1.0, 3.0], "spot")],
        [episode_of([4.0, 0.5, 1.0], "lean"), episode_of(2.0)],
    ],
    ids=["many", "one", "a target of zero", "velocity", "three families", "a plane", "vectors beside numbers"],
)
def test_transfer(episodes, tmp_path):
    results = results_of(*episodes)
    plot_transfer(results, results, results, tmp_path / "new" / "transfer.png")
    assert_drawn(tmp_path / "new" / "transfer.png")


@pytest.mark.parametrize(
    ("family", "target"), [("goal", 2.0), ("velocity", 2.0), ("spot", [2.0, -1.0]), ("lean", [2.0, 0.5, 1.0])]
)
def test_episode(family, target, tmp_path):
    plot_episode(episode_of(target, family), tmp_path / "episode.png")
    assert_drawn(tmp_path / "episode.png")


@pytest.fixture
def switched():
    """A goal of 2 m that becomes a speed of -1 m/s in the middle, noticed three decisions later."""
    half, later = TIME // 2, TIME // 2 + 3
    return replace(
        episode_of(2.0),
        switch={"at_s": 1.5, "family": "velocity", "target": [-1.0]},
        active_family=["goal"] * half + ["velocity"] * half,
        active_target=[[2.0]] * half + [[-1.0]] * half,
        inferred_family=["goal"] * later + ["velocity"] * (TIME - later),
        inferred_target=[[1.9]] * later + [[-0.9]] * (TIME - later),
    )


def test_episode_with_a_switch(switched, tmp_path):
    plot_episode(switched, tmp_path / "episode.png")
    assert_drawn(tmp_path / "episode.png")


@pytest.mark.parametrize(
    ("family", "wanted", "read", "first", "last"),
    [("goal", 2.0, 1.9, (0, 0), (14, 17)), ("velocity", -1.0, -0.9, (15, 18), (29, 19))],
)
def test_each_family_is_drawn_by_itself_while_it_counts(switched, family, wanted, read, first, last):
    """Until the 20th decision."""
    drawing, axes = plt.subplots()
    draw_progress(axes, switched, FAMILIES.named(family), 20)
    lines = dict(zip(("wanted", "read", "robot"), (line.get_ydata() for line in axes.lines), strict=True))
    plt.close(drawing)
    assert [each.name for each in switched.asked] == ["goal", "velocity"]
    for name, value, begin, end in (("wanted", wanted, first[0], last[0]), ("read", read, first[1], last[1])):
        shown = np.flatnonzero(np.isfinite(lines[name]))
        np.testing.assert_array_equal(lines[name][shown], value)
        assert (shown[0], shown[-1]) == (begin, end)
    robot = switched.quantities["x" if family == "goal" else "vx"]
    np.testing.assert_allclose(lines["robot"], robot[:20])


def test_a_vector_has_a_line_per_component_and_a_place_of_a_plane_is_in_it():
    lean, place = episode_of([2.0, 0.5, 1.0], "lean"), episode_of([2.0, -1.0], "spot")
    drawing, (in_time, in_plane) = plt.subplots(1, 2)
    draw_progress(in_time, lean, FAMILIES.named("lean"))
    draw_progress(in_plane, place, FAMILIES.named("spot"))
    named = {line.get_label(): line for line in (*in_time.lines, *in_plane.lines)}
    plt.close(drawing)
    for i, name in enumerate(("x", "pitch", "vz")):
        np.testing.assert_allclose(named[f"robot {name}"].get_ydata(), lean.reached[:, i])
    np.testing.assert_allclose(named["robot"].get_xydata(), place.reached)
    assert (in_plane.get_xlabel(), in_plane.get_ylabel()) == ("x [m]", "y [m]")


def test_a_figure_that_fails_leaves_neither_file_nor_memory(tmp_path):
    with pytest.raises(ValueError, match="shape"), figure(tmp_path / "a.png", 1, 1, size=(4.0, 3.0)) as (_, (axes,)):
        axes.plot([0, 1], [0, 1, 2])
    assert not list(tmp_path.iterdir())
    assert not plt.get_fignums()
