"""Figures of evaluations: trajectories, errors and latents."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from rebody.evaluation.results import EpisodeResult, Results
from rebody.report.style import BELIEF, IDLE, MOTION, ORACLE, TASKS, TRUTH, figure
from rebody.tasks import FAMILIES


def plot_transfer(results: Results, oracle: Results, idle: Results, path: Path) -> None:
    """Trajectories, latents against targets, and errors of three agents, side by side."""
    with figure(path, 1, 3, size=(14.0, 4.2)) as (drawing, (motion, latent, errors)):
        _trajectories(motion, results)
        _latents(latent, results)
        _errors(errors, {"reuse": results, "oracle": oracle, "idle": idle})
        drawing.suptitle(
            f"Inference module '{results.inference}', trained on a point mass, on the {results.robot}: "
            "the target is told to nobody but the oracle"
        )


def plot_episode(episode: EpisodeResult, path: Path) -> None:
    """One episode: what was reached, what was believed, what was asked of the tracker."""
    with figure(path, 3, 1, size=(8.0, 7.5)) as (_, (reached, rewards, latents)):
        draw_progress(reached, episode)
        rewards.plot(episode.time_s, episode.reward, color=MOTION)
        rewards.set(ylabel="reward: all that is heard", xlabel="time [s]")
        latents.plot(episode.time_s, episode.latent)
        latents.set(ylabel="latent mean", xlabel="time [s]")


def draw_progress(axes: Axes, episode: EpisodeResult, until: int | None = None) -> None:
    """Reached, believed and true value over time, up to a decision."""
    unit = _unit(episode.active_family[-1])
    reached = _reached(episode)
    axes.plot(episode.time_s, episode.active_target, "--", color=TRUTH, label="hidden target")
    axes.plot(episode.time_s[:until], episode.inferred_target[:until], color=BELIEF, label="read from the belief")
    axes.plot(episode.time_s[:until], reached[:until], color=MOTION, lw=2, label="robot")
    spread = [*reached, *episode.active_target]
    margin = 0.25 * max(np.ptp(spread), 1.0)
    axes.set(
        xlabel="time [s]",
        ylabel=f"{episode.active_family[-1]} [{unit}]",
        xlim=(0, episode.time_s[-1]),
        ylim=(min(spread) - margin, max(spread) + margin),
    )
    axes.legend(loc="lower right", frameon=False, fontsize=8)


def _reached(episode: EpisodeResult) -> list[float]:
    """The number that the last task is about."""
    series = {"goal": episode.position_m, "velocity": episode.velocity_m_s, "stand": episode.pitch_rad}
    return series[episode.active_family[-1]]


def _trajectories(axes: Axes, results: Results) -> None:
    largest = max(abs(e.active_target[-1]) for e in results.episodes) or 1.0
    for episode in results.episodes:
        colour = plt.get_cmap(TASKS)(0.5 + 0.5 * episode.active_target[-1] / largest)
        axes.plot(episode.time_s, _reached(episode), color=colour, lw=1.2)
        axes.plot(episode.time_s[-1], episode.active_target[-1], "o", color=colour, ms=4, clip_on=False)
    family = results.episodes[0].active_family[-1]
    axes.set(xlabel="time [s]", ylabel=f"{family} [{_unit(family)}]", title="robot (lines), hidden targets (dots)")


def _latents(axes: Axes, results: Results) -> None:
    targets = [episode.active_target[-1] for episode in results.episodes]
    final = np.array([episode.latent[-1] for episode in results.episodes])
    for dimension in range(final.shape[1]):
        axes.plot(targets, final[:, dimension], ".", label=f"latent {dimension + 1}")
    axes.set(
        xlabel=f"hidden target [{_unit(results.episodes[0].active_family[-1])}]",
        ylabel="latent mean at the end",
        title="what it believes against what is true",
    )
    axes.legend(frameon=False)


def _errors(axes: Axes, agents: dict[str, Results]) -> None:
    colours = {"reuse": MOTION, "oracle": ORACLE, "idle": IDLE}
    for name, results in agents.items():
        errors = np.sort([max(episode.final_error, 1e-3) for episode in results.episodes])
        share = np.arange(1, len(errors) + 1) / len(errors)
        axes.step(errors, 100 * share, where="post", label=name, color=colours[name])
    unit = _unit(next(iter(agents.values())).episodes[0].active_family[-1])
    axes.set(
        xscale="log",
        xlabel=f"final error [{unit}]",
        ylabel="episodes with at most this error [%]",
        title="what inference brings",
    )
    axes.legend(frameon=False, loc="upper center")


def _unit(family: str) -> str:
    return next(f.unit for f in FAMILIES if f.name == family)
