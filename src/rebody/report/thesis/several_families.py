"""Section 6.4.2 of the thesis: one module for goals and speeds, front and back."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes

from rebody.agents.parts import load_inference
from rebody.bodies.robot import Reach
from rebody.evaluation.evaluate import Trial
from rebody.report.style import BELIEF, MOTION, ORACLE, TRUTH, figure
from rebody.report.thesis.data import Data, split, training_log, trajectories
from rebody.report.thesis.panels import caption, draw_curve
from rebody.tasks import GOAL, JUMP, STAND, VELOCITY, base_task
from rebody.tasks.task_file import TaskSpec
from rebody.training.inference import PRESETS, train_inference
from rebody.types import Task

Latents = Float[np.ndarray, "time episode latent"]
BASE_TASKS = {
    2 * GOAL + 1: ("goal in front", "#b5403c"),
    2 * GOAL: ("goal behind", "#2b6f9e"),
    2 * VELOCITY + 1: ("run forward", "#e0a526"),
    2 * VELOCITY: ("run backward", "#4f9a6b"),
    2 * STAND + 1: ("stand, pitch above 0", "#7d4e9e"),
    2 * STAND: ("stand, pitch below 0", "#5a5a5a"),
    2 * JUMP + 1: ("jump", "#c2557f"),
}
"""Name and colour by the number that `base_task` gives."""
SERIES = {
    GOAL: ("position_m", "x [m]"),
    VELOCITY: ("velocity_m_s", "velocity [m/s]"),
    STAND: ("pitch_rad", "pitch [rad]"),
    JUMP: ("vz_max_m_s", "largest vertical speed of 1 s [m/s]"),
}
"""Of each family: what is to reach the target, and its label."""
EPISODES = 12
"""Of each base task in a picture of latents."""
SHOWN = 4
"""Of each base task in a picture of ways."""
FROM = 20
"""First decision whose latent is shown."""
EVERY = 6
"""Decisions from one latent that is shown to the next."""


# 6.13


def training() -> Data:
    """Of the shipped module."""
    return training_log("goal-velocity", "inference")


def train_again(runs: Path) -> Data:
    """Of a module trained anew."""
    out = runs / "goal-velocity"
    train_inference(PRESETS["goal-velocity"](), out, 0, title="Inference: goal-velocity", resume=True)
    return training_log(out, "inference")


def draw_training(data: Data, path: Path, text: str) -> None:
    """Return, sharpness, and clusters over toy steps."""
    with figure(path, 2, 2, size=(11.0, 8.0)) as (drawing, (returns, errors, clusters, agreement)):
        draw_curve(returns, data, "return", "training episodes", colour="#9dbbd3")
        draw_curve(returns, data, "evaluation/return", "held-out tasks", dots=True)
        draw_curve(returns, data, "evaluation/oracle return", "held-out tasks, told", colour=ORACLE, dots=True)
        returns.set(ylabel="return over 20 s", ylim=(-300, 0))
        for family, colour in (("goal", MOTION), ("velocity", BELIEF)):
            draw_curve(errors, data, f"evaluation/{family} median", f"{family}, median", colour=colour, dots=True)
        errors.set(ylabel="final error [m], [m/s]", yscale="log")
        draw_curve(clusters, data, "mixture/components", "components", colour=TRUTH)
        for move, colour in (("births", MOTION), ("merges", BELIEF)):
            draw_curve(clusters, data, f"mixture/{move}", f"{move} in the iteration", colour=colour)
        clusters.set(ylabel="clusters", ylim=(0, None))
        draw_curve(agreement, data, "mixture/purity", "purity", colour=MOTION)
        draw_curve(agreement, data, "mixture/ari", "adjusted Rand index", colour=BELIEF)
        agreement.set(ylabel="agreement with base tasks", ylim=(0, 1.02))
        for axes in (returns, errors, clusters, agreement):
            axes.set_xlabel("toy steps [million]")
            axes.legend(frameon=False, fontsize=8)
        caption(drawing, text)


# 6.14


def on_toy() -> Data:
    """`goal-velocity` on the toy."""
    return trajectories(Trial("reuse", load_inference("goal-velocity"), None, None), tasks_of_each_kind())


def projections() -> Data:
    """Its latents in two dimensions: by t-SNE as in the thesis, and by PCA."""
    # a second to import, which every command would wait for
    from sklearn.decomposition import PCA
    from sklearn.manifold import TSNE

    data = on_toy()
    latents = late_latents(data)
    return {name: data[name] for name in ("family", "target")} | {
        "tsne": in_plane(latents, TSNE(random_state=0).fit_transform),
        "pca": in_plane(latents, PCA(2).fit_transform),
    }


def late_latents(data: Data) -> Latents:
    """Those that are shown, when something is known."""
    return data["latent"][FROM::EVERY]


def in_plane(latents: Latents, projection: Callable[[np.ndarray], np.ndarray]) -> Float[np.ndarray, "time episode 2"]:
    """Latents by a projection of rows to two dimensions."""
    flat = projection(latents.reshape(-1, latents.shape[-1]))
    return flat.reshape(*latents.shape[:2], 2).astype(np.float32)


def tasks_of_each_kind(reach: Reach | None = None, preset: str = "goal-velocity") -> list[TaskSpec]:
    """Evenly spaced over each base task, as far as a body reaches."""
    specs = []
    for task in PRESETS[preset]().tasks.base_tasks:
        ends = reach.within(task.family, task.low, task.high) if reach else (task.low, task.high)
        targets = np.linspace(*ends, EPISODES)
        specs += [TaskSpec(task.family, float(target)) for target in targets]
    return specs


def draw_ways(data: Data, path: Path, text: str) -> None:
    """Positions on goals, velocities on speeds."""
    with figure(path, 1, 2, size=(10.5, 4.4)) as (drawing, panels):
        ways_panels(panels, data)
        caption(drawing, text)


def draw_ways_of_each(data: Data, titles: Mapping[str, str], path: Path, text: str) -> None:
    """A row for each of several logs, under its title."""
    rows = len(titles)
    with figure(path, rows, 2, size=(10.5, 1.0 + 3.6 * rows)) as (drawing, panels):
        for (part, title), row in zip(titles.items(), zip(panels[::2], panels[1::2], strict=True), strict=True):
            ways_panels(row, split(data, part))
            row[0].set_title(title, fontsize=9, loc="left")
        caption(drawing, text)


def ways_panels(panels: Sequence[Axes], data: Data) -> None:
    """A few episodes of each base task, dotted what was hidden: a panel for goals, speeds, and pitches if there is a
    third."""
    for axes, (family, (series, label)) in zip(panels, SERIES.items(), strict=False):
        for i in np.flatnonzero(data["family"] == family)[:: EPISODES // SHOWN]:
            _, colour = BASE_TASKS[_labels(data)[i]]
            axes.plot(data["time_s"], data[series][:, i], color=colour, lw=1.2)
            axes.axhline(float(data["target"][i]), color=colour, lw=0.8, ls=":")
        axes.set(xlabel="time [s]", ylabel=label, xlim=(0, data["time_s"][-1]))


def draw_projections(data: Data, path: Path, text: str) -> None:
    """Latents of many decisions in two dimensions."""
    with figure(path, 1, 2, size=(10.5, 5.2)) as (drawing, (tsne, pca)):
        points_panel(tsne, data["tsne"], data)
        points_panel(pca, data["pca"], data)
        tsne.set(title="t-SNE")
        pca.set(title="PCA")
        tsne.legend(frameon=False, fontsize=8, markerscale=2)
        caption(drawing, text)


def points_panel(axes: Axes, points: np.ndarray, data: Data) -> None:
    """Points [time, episode, 2] in the colours of their base tasks."""
    for number, (name, colour) in BASE_TASKS.items():
        x, y = points[:, np.array(_labels(data)) == number].reshape(-1, 2).T
        axes.plot(x, y, ".", color=colour, ms=3, label=name)
    axes.set(xticks=[], yticks=[])


def _labels(data: Data) -> list[int]:
    return np.asarray(base_task(Task(data["family"], data["target"]))).tolist()
