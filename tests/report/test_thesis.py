"""The thesis' figures: what they are drawn from, and that each of them is drawn."""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest
import safetensors.numpy
from PIL import Image

from rebody.cli.main import run
from rebody.errors import RebodyError
from rebody.report.thesis import FIGURES, catalogue, data, episodes, find_figures, make_figure, panels
from rebody.report.thesis.data import join, on_goals, save, split, trajectories
from rebody.report.thesis.learning import HIGH_LEVELS
from rebody.report.thesis.trainings import training_log
from rebody.tasks.line import GOAL, LINE, STAND, VELOCITY
from rebody.tasks.task_file import Switch, TaskSpec

CAPTION = "What is seen, in so many words that a line does not hold all of them. " * 4 + "\nMade by a test."


def episodes_of(latent, targets=(-9.0, 0.5, 4.0), decision_s=0.1, time=40):
    """What `trajectories` gives, of agents that find their goals."""
    time_s = 0.1 * np.arange(1.0, time + 1)
    position = np.array(targets) * (1 - np.exp(-time_s))[:, None]
    return {
        "time_s": time_s,
        "position_m": position,
        "velocity_m_s": np.gradient(position, axis=0) / 0.1,
        "pitch_rad": position,
        "latent": np.stack([(i + 1) * position / 10 for i in range(latent)], axis=-1),
        "family": np.full(len(targets), LINE.index(GOAL.name)),
        "target": np.array(targets),
        "decision_s": np.array(decision_s),
    }


def curves_of(*names, measured_every=3, rows=12):
    """What `training_log` gives, of measurements that were taken now and then."""
    steps = 10_000.0 * np.arange(1, rows + 1, dtype=np.float32)
    falling = np.where(np.arange(rows) % measured_every == measured_every - 1, 1e5 / steps, np.nan)
    return {"steps": steps} | {name: falling.astype(np.float32) for name in names}


def several_of(episodes=3, families=(GOAL, VELOCITY)):
    """Latents in two dimensions of a few episodes on each base task."""
    targets = np.concatenate([side * np.arange(2.0, 2.0 + episodes) for side in (1, -1) * len(families)])
    data = episodes_of(6, targets)
    rng = np.random.default_rng(0)
    family = np.repeat([LINE.index(each.name) for each in families], 2 * episodes)
    return data | {"family": family} | {name: rng.normal(size=(6, len(targets), 2)) for name in ("tsne", "pca")}


PICTURE = {"picture": np.random.default_rng(0).integers(0, 255, (48, 64, 3)).astype(np.uint8)}
STRIDES = {str(stride): episodes_of(1, decision_s=0.05 * stride) for stride in episodes.STRIDES}
ON_ROBOT = several_of(panels.EPISODES) | {"toy_pca": several_of()["pca"]}
SYNTHETIC = {
    "6.1": PICTURE,
    "6.2": curves_of("return", "evaluation/return", "evaluation/oracle return"),
    "6.3": episodes_of(1, targets=episodes.THESIS_GOALS),
    "6.5": episodes_of(2),
    "6.6": curves_of("task_reward", "evaluation/goal median", "evaluation/goal p95"),
    "6.7": curves_of(*(f"evaluation/{slot} {of}" for slot in ("goal", "velocity", "stand")
        for of in ("median", "p95"))),
    "6.8": episodes_of(1, targets=(3.0,), decision_s=0.05),  # a single goal
    "6.9": join(STRIDES | {"ours": episodes_of(2)}),
    **dict.fromkeys(("6.10", "6.11"), join({"thesis": episodes_of(1), "ours": episodes_of(2)})),
    "6.12": join(
        {
            f"tracker-{robot}": curves_of("reward", "falls_per_minute", measured_every=1)
            for robot in ("hopper", "walker")
        }
    ),
    "6.13": curves_of(
        "return", "evaluation/return", "evaluation/oracle return", "evaluation/goal median",
        "evaluation/velocity median", "mixture/components", "mixture/births", "mixture/merges", "mixture/purity",
        "mixture/ari",
    ),
    "6.14a": several_of(panels.EPISODES),
    "6.14b": several_of(),
    "6.15": join({name: several_of(panels.EPISODES) for name in catalogue.RANDOMISED}),
    "6.19": join({name: curves_of("evaluation/return") for name in HIGH_LEVELS}),
    **dict.fromkeys(
        ("6.20", "6.21"),
        join({name: several_of(panels.EPISODES) for name in HIGH_LEVELS}),
    ),
    "6.22": several_of(panels.EPISODES, (GOAL, VELOCITY, STAND)),
    **dict.fromkeys(("6.16", "6.17", "6.18"), ON_ROBOT),
}  # fmt: skip


def assert_drawn(path):
    with Image.open(path) as picture:
        assert picture.format == "PNG"
        pixels = np.asarray(picture.convert("L"))
    assert min(pixels.shape) > 300
    assert (pixels < 128).mean() > 0.003  # there is something on it
    assert (pixels[-pixels.shape[0] // 8 :] < 128).mean() > 0.003  # and a caption below
    assert not plt.get_fignums()  # nothing stays open


@pytest.mark.parametrize("number", FIGURES)
def test_every_figure_can_be_drawn(number, tmp_path):
    FIGURES[number].draw(SYNTHETIC[number], tmp_path / "figure.png", CAPTION)
    assert_drawn(tmp_path / "figure.png")


@pytest.mark.parametrize("number", FIGURES)
def test_every_figure_ships(number, tmp_path, capsys):
    assert run(["figure", number, "--out", str(tmp_path)]) == 0
    assert_drawn(tmp_path / f"{number}.png")
    assert f"{number}.png: {FIGURES[number].title}" in capsys.readouterr().out
    assert [path.name for path in tmp_path.iterdir()] == [f"{number}.png"]


def test_what_is_drawn_depends_on_the_log(tmp_path):
    pixels = []
    for i, latent in enumerate((1, 2, 2)):
        FIGURES["6.5"].draw(episodes_of(latent), tmp_path / f"{i}.png", CAPTION)
        with Image.open(tmp_path / f"{i}.png") as picture:
            pixels.append(np.asarray(picture))
    assert (pixels[0] != pixels[1]).any()
    np.testing.assert_array_equal(pixels[1], pixels[2])


def test_figures_are_found_by_number():
    assert [figure.number for figure in find_figures(["6.9", "6.1", "6.9"])] == ["6.9", "6.1"]
    assert find_figures(["all"]) == list(FIGURES.values())
    with pytest.raises(
        RebodyError, match=r"unknown figure '6\.99'\. Did you mean '6\.9'\? Figures are: 6\.1, 6\.2, .*, or all"
    ):
        find_figures(["6.1", "6.99"])


@pytest.fixture
def figure(monkeypatch):
    """A figure out of synthetic logs, which says where it took them from."""
    told = []

    def rerun():
        told.append("anew")
        return episodes_of(1, targets=(1.0, 2.0))

    monkeypatch.setattr(data, "shipped", SYNTHETIC.get)
    return replace(FIGURES["6.3"], log=rerun), told


def test_a_figure_is_made_from_what_ships(figure, tmp_path):
    made, told = figure
    path = make_figure(made, tmp_path / "new", rerun=False)
    assert_drawn(path)
    assert list((tmp_path / "new").iterdir()) == [path]
    assert not told


def test_a_rerun_leaves_its_log(figure, tmp_path):
    made, told = figure
    assert_drawn(make_figure(made, tmp_path, rerun=True))
    assert told == ["anew"]
    log = safetensors.numpy.load_file(tmp_path / "6.3.safetensors")
    np.testing.assert_array_equal(log["target"], [1.0, 2.0])
    made.draw(log, tmp_path / "again.png", CAPTION)
    assert_drawn(tmp_path / "again.png")


@pytest.mark.parametrize("rerun", [False, True])
def test_the_caption_says_how_it_was_made(figure, tmp_path, rerun, monkeypatch):
    captions, made = [], figure[0]
    monkeypatch.setattr(panels, "caption", lambda drawing, text: captions.append(text))
    make_figure(made, tmp_path, rerun=rerun)
    command, source = ("rebody figure 6.3 --rerun", "anew") if rerun else ("rebody figure 6.3", "the log that ships")
    assert captions[0].startswith(made.caption)
    assert f"`{command}`" in captions[0]
    assert source in captions[0]


def test_a_log_that_does_not_ship_is_one_message(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(data, "LOGS", tmp_path / "none")
    assert run(["figure", "6.3", "--out", str(tmp_path / "out")]) == 2
    complaint = capsys.readouterr().err
    assert complaint.startswith("error: ")
    assert "6.3.safetensors" in complaint
    assert "Traceback" not in complaint


def test_logs_are_joined_and_split_and_saved(tmp_path):
    save(join({"a": episodes_of(1), "b": episodes_of(2)}), tmp_path / "log.safetensors")
    log = safetensors.numpy.load_file(tmp_path / "log.safetensors")
    for part, latent in (("a", 1), ("b", 2)):
        for name, array in episodes_of(latent).items():
            np.testing.assert_array_equal(split(log, part)[name].squeeze(), array.squeeze())
    assert split(log, "a").keys() == episodes_of(1).keys()


@pytest.mark.parametrize(
    ("kind", "per_iteration", "measured"),
    [("inference", 8 * 24, "return"), ("tracker", 4 * 4, "critic_loss"), ("flat", 4 * 4, "task_reward")],
)
def test_training_curves_come_out_of_the_artifact(trained, kind, per_iteration, measured):
    log = training_log(trained[kind])
    np.testing.assert_array_equal(log["steps"], per_iteration * np.arange(1, 10))
    assert np.isfinite(log[measured]).all()
    assert {len(column) for column in log.values()} == {9}
    if kind == "inference":
        np.testing.assert_array_equal(np.isnan(log["critic_loss"]), [True] + [False] * 8)


@pytest.mark.parametrize(
    ("changes", "decision_s"),
    [({}, 0.1), ({"thesis": True, "stride": 3}, 0.15), ({"robot": None, "tracker": None, "flat": None}, 0.1)],
)
def test_trajectories_are_those_of_the_trial(trial, changes, decision_s):
    log = on_goals(replace(trial, **changes), np.array([-3.0, 2.0]))
    np.testing.assert_allclose(log["time_s"], 0.1 * np.arange(1, 31))
    assert log["position_m"].shape == log["velocity_m_s"].shape == (30, 2)
    assert log["latent"].shape == (30, 2, 2)
    np.testing.assert_array_equal(log["target"], [-3.0, 2.0])
    np.testing.assert_array_equal(log["family"], [LINE.index(GOAL.name)] * 2)
    assert float(log["decision_s"]) == pytest.approx(decision_s)
    assert np.abs(log["position_m"][-1]).min() > 1e-3
    displacement = np.diff(log["position_m"], axis=0) / 0.1
    np.testing.assert_allclose(log["velocity_m_s"][1:], displacement, atol=1e-4)


def test_trajectories_are_of_the_task_that_an_episode_ends_with(trial):
    toy = replace(trial, robot=None, tracker=None, flat=None, agent="oracle")
    log = trajectories(toy, [TaskSpec("goal", (3.0,)), TaskSpec("goal", (3.0,), Switch(1.0, "goal", (-1.0,)))])
    np.testing.assert_array_equal(log["target"], [3.0, -1.0])


def test_long_trajectories_are_thinned_out(trial, monkeypatch):
    specs = [TaskSpec("goal", (2.0,))]
    whole = trajectories(trial, specs)
    monkeypatch.setattr(data, "POINTS", 12)
    thin = trajectories(trial, specs)
    np.testing.assert_allclose(thin["time_s"], [0.3, 0.6, 0.9, 1.2, 1.5, 1.8, 2.1, 2.4, 2.7, 3.0])
    for name in ("position_m", "velocity_m_s", "latent"):
        np.testing.assert_array_equal(thin[name], whole[name][2::3])


def test_the_latents_that_are_shown_are_those_of_evenly_spaced_tasks(monkeypatch, trial):
    """Their two dimensions by PCA span what the episodes' latents do."""
    asked = []

    def listen(trial, specs):
        asked.extend(specs)
        targets = np.array([spec.target for spec in specs])
        return several_of(panels.EPISODES) | {"latent": np.random.default_rng(0).normal(size=(40, len(targets), 6))}

    monkeypatch.setattr(episodes, "load_inference", lambda name: trial.inference)
    monkeypatch.setattr(episodes, "trajectories", listen)
    log = episodes.projections()
    of_family = {name: sorted(spec.target[0] for spec in asked if spec.family == name) for name in ("goal", "velocity")}
    np.testing.assert_allclose(of_family["goal"], np.sort(np.r_[1, -1][:, None] * np.linspace(2, 15, 12), axis=None))
    np.testing.assert_allclose(of_family["velocity"], np.sort(np.r_[1, -1][:, None] * np.linspace(1, 3, 12), axis=None))
    shown = episodes.on_toy()["latent"][episodes.FROM :: episodes.EVERY]
    assert log["tsne"].shape == log["pca"].shape == (*shown.shape[:2], 2)
    flat, pca = shown.reshape(-1, 6), log["pca"].reshape(-1, 2)
    largest = np.linalg.svd(flat - flat.mean(axis=0), compute_uv=False)[:2]
    np.testing.assert_allclose(np.linalg.norm(pca, axis=0), largest, rtol=1e-3)


def test_each_base_task_has_its_name_and_colour():
    family = [LINE.index(each.name) for each in (GOAL, GOAL, VELOCITY, VELOCITY)]
    data = {"family": np.array(family), "target": np.array([3.0, -3.0, 1.0, -1.0])}
    names = [panels.BASE_TASKS[label][0] for label in panels.labels(data)]
    assert names == ["goal in front", "goal behind", "run forward", "run backward"]
    assert len({colour for _, colour in panels.BASE_TASKS.values()}) == len(panels.BASE_TASKS)


def test_every_figure_has_a_number_that_the_list_shows(capsys):
    assert run(["list"]) == 0
    listed = capsys.readouterr().out
    for number, figure in FIGURES.items():
        assert figure.number == number
        assert number in listed
