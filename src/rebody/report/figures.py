"""Figures of evaluations: trajectories, errors and latents."""

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from rebody.evaluation.episode import EpisodeResult
from rebody.evaluation.results import Results
from rebody.report.style import BELIEF, IDLE, MOTION, ORACLE, TASKS, TRUTH, as_text, figure
from rebody.tasks import family_named

FAMILY_COLOURS = (MOTION, BELIEF, IDLE, ORACLE)


def plot_transfer(results: Results, oracle: Results, idle: Results, path: Path) -> None:
    """Trajectories and errors of each family, and what was believed, of three agents on the same tasks."""
    families = results.families
    columns = len(families) + 1
    with figure(path, 2, columns, size=(4.7 * columns, 7.4)) as (drawing, panels):
        for i, family in enumerate(families):
            draw_trajectories(panels[i], results.of(family))
            agents = {"reuse": results, "oracle": oracle, "idle": idle}
            _errors(panels[columns + i], {name: of.of(family) for name, of in agents.items()}, family)
        draw_beliefs(panels[columns - 1], results)
        draw_readings(panels[-1], results)
        drawing.suptitle(
            f"Inference module '{as_text(results.inference)}', trained on a point mass, "
            f"on the {as_text(results.robot)}: the task is told to nobody but the oracle"
        )


def plot_episode(episode: EpisodeResult, path: Path) -> None:
    """One episode: what was reached and believed of each family that was asked for, the reward, the latent."""
    families = episode.families
    rows = len(families) + 2
    with figure(path, rows, 1, size=(8.0, 2.5 * rows)) as (_, (*reached, rewards, latents)):
        for axes, family in zip(reached, families, strict=True):
            draw_progress(axes, episode, family)
        rewards.plot(episode.time_s, episode.reward, color=MOTION)
        rewards.set(ylabel="reward: all that is heard", xlabel="time [s]")
        latents.plot(episode.time_s, episode.latent)
        latents.set(ylabel="latent mean", xlabel="time [s]")


def draw_progress(axes: Axes, episode: EpisodeResult, family: str, until: int | None = None) -> None:
    """What a family is about, up to a decision: reached, read from the belief, and true while it was asked."""
    time, reached = np.array(episode.time_s), np.array(episode.reached_of(family))
    wanted = np.where(np.equal(episode.active_family, family), episode.active_target, np.nan)
    read = np.where(np.equal(episode.inferred_family, family), episode.inferred_target, np.nan)
    axes.plot(time, wanted, "--", color=TRUTH, label="hidden target")
    axes.plot(time[:until], read[:until], ".", color=BELIEF, ms=4, label="read from the belief")
    axes.plot(time[:until], reached[:until], color=MOTION, lw=1.5, label="robot")
    spread = [*reached, *wanted[np.isfinite(wanted)]]
    margin = 0.15 * max(np.ptp(spread), 1.0)
    axes.set(
        xlabel="time [s]",
        ylabel=f"{family} [{_unit(family)}]",
        xlim=(0, time[-1]),
        ylim=(min(spread) - margin, max(spread) + margin),
    )
    axes.set_title(" ", fontsize=8)  # room for the legend, which must not push panels apart
    legend = axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=3, frameon=False, fontsize=8, borderaxespad=0)
    legend.set_in_layout(False)


def draw_trajectories(axes: Axes, episodes: list[EpisodeResult]) -> None:
    """What the robot did in episodes of one family, each target a dot of its colour at the end."""
    largest, family = max(abs(e.active_target[-1]) for e in episodes) or 1.0, episodes[0].active_family[-1]
    for episode in episodes:
        colour = plt.get_cmap(TASKS)(0.5 + 0.5 * episode.active_target[-1] / largest)
        axes.plot(episode.time_s, episode.reached, color=colour, lw=1.2)
        axes.plot(episode.time_s[-1], episode.active_target[-1], "o", color=colour, ms=4, clip_on=False)
    axes.set(xlabel="time [s]", ylabel=f"{family} [{_unit(family)}]", title=f"{family}: robot (lines), targets (dots)")


def draw_beliefs(axes: Axes, results: Results) -> None:
    """The latents at the end."""
    if len(results.families) > 1 and len(results.episodes[0].latent[0]) > 1:
        _kinds(axes, results)
    else:
        _latents(axes, results)


def _kinds(axes: Axes, results: Results) -> None:
    """Which of several families it is shows in the latent's first numbers."""
    for family, colour in zip(results.families, FAMILY_COLOURS, strict=False):
        final = np.array([episode.latent[-1] for episode in results.of(family)])
        axes.plot(final[:, 0], final[:, 1], ".", color=colour, label=family)
    axes.set(xlabel="latent 1", ylabel="latent 2", title="the belief at the end: what kind of task")


def _latents(axes: Axes, results: Results) -> None:
    """Of one family: the whole latent against the target."""
    targets = [episode.active_target[-1] for episode in results.episodes]
    final = np.array([episode.latent[-1] for episode in results.episodes])
    for dimension in range(final.shape[1]):
        axes.plot(targets, final[:, dimension], ".", label=f"latent {dimension + 1}")
    unit = _unit(results.episodes[0].active_family[-1])
    axes.set(xlabel=f"hidden target [{unit}]", ylabel="latent mean", title="the belief at the end")


def draw_readings(axes: Axes, results: Results) -> None:
    """What a linear probe reads from the last belief, over what is true."""
    for family, colour in zip(results.families, FAMILY_COLOURS, strict=False):
        of = results.of(family)
        truth = [episode.active_target[-1] for episode in of]
        read = [episode.inferred_target[-1] for episode in of]
        axes.plot(truth, read, "o", color=colour, mfc="none", label=f"{family} [{_unit(family)}]")
    axes.axline((0, 0), slope=1, color=TRUTH, lw=0.7)
    axes.set(xlabel="hidden target", ylabel="read from the belief", title="the belief at the end: how much")


def _errors(axes: Axes, agents: dict[str, list[EpisodeResult]], family: str) -> None:
    colours = {"reuse": MOTION, "oracle": ORACLE, "idle": IDLE}
    for name, episodes in agents.items():
        draw_errors(axes, episodes, label=name, color=colours[name])
    axes.set(
        xlabel=f"{family}: final error [{_unit(family)}]",
        ylabel="episodes with at most this error [%]",
        title="what inference brings",
    )
    axes.legend(loc="upper center")


def draw_errors(axes: Axes, episodes: list[EpisodeResult], **style: Any) -> None:
    """Which share of episodes has at most which final error; a millimetre stands for anything below it."""
    errors = np.sort([max(episode.final_error, 1e-3) for episode in episodes])
    share = np.arange(len(errors) + 1) / len(errors)
    axes.step([errors[0], *errors], 100 * share, where="post", **style)
    axes.set(xscale="log")


def _unit(family: str) -> str:
    return family_named(family).unit
