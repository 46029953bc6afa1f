"""Figures of evaluations: trajectories, errors and latents."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes

from rebody.agents.belief import Reading
from rebody.evaluation.episode import EpisodeResult
from rebody.evaluation.results import Results
from rebody.report.plane import draw_circle, draw_map, draw_rim, draw_turn, is_heading, is_place, is_plane, path_of
from rebody.report.style import BELIEF, IDLE, MOTION, ORACLE, SHADES, TASKS, TRUTH, as_text, figure
from rebody.tasks import Family
from rebody.tasks.family_set import fit
from rebody.tasks.figures import settled

SMALLEST = 1e-3
"""What is nearer is drawn so [m, m/s, rad]."""
MARKERS = "os^vD"
"""Of a vector's components, by turns."""


def plot_transfer(results: Results, oracle: Results, idle: Results, path: Path) -> None:
    """Trajectories and errors of each family, and what was believed, of three agents on the same tasks."""
    families = results.families
    columns = len(families) + 1
    with figure(path, 2, columns, size=(4.7 * columns, 7.4)) as (drawing, panels):
        for i, family in enumerate(families):
            draw_trajectories(panels[i], results.of(family.name))
            agents = {"reuse": results, "oracle": oracle, "idle": idle}
            _errors(panels[columns + i], {name: of.of(family.name) for name, of in agents.items()}, family)
        draw_beliefs(panels[columns - 1], results)
        draw_readings(panels[-1], results)
        drawing.suptitle(
            f"Inference module '{as_text(results.inference)}', trained on a point mass, "
            f"on the {as_text(results.robot)}: the task is told to nobody but the oracle"
        )


def plot_episode(episode: EpisodeResult, path: Path, readings: Sequence[Reading] | None = None) -> None:
    """One episode: what was reached and believed of each family that was asked for, the reward, the latent; of the
    plane a map, how far robot and belief are from the target, the reward, and how likely each family was.

    `readings` are what was believed after each decision (`rebody.evaluation.listening`), for ellipses and chances.
    """
    if path_of(episode) is not None:
        return _plot_in_plane(episode, path, readings)
    families = episode.asked
    rows = len(families) + 2
    with figure(path, rows, 1, size=(8.0, 2.5 * rows)) as (_, (*reached, rewards, latents)):
        for axes, family in zip(reached, families, strict=True):
            draw_progress(axes, episode, family)
        rewards.plot(episode.time_s, episode.reward, color=MOTION)
        rewards.set(ylabel="reward: all that is heard", xlabel="time [s]")
        latents.plot(episode.time_s, episode.latent)
        latents.set(ylabel="latent mean", xlabel="time [s]")


def _plot_in_plane(episode: EpisodeResult, path: Path, readings: Sequence[Reading] | None) -> None:
    asked = [family for family in episode.asked if not is_place(family)]
    columns = 2 + len(asked)
    with figure(path, 2, columns, size=(4.4 * columns, 8.0)) as (drawing, panels):
        (seen, *of_asked, missed), (rewards, *chances) = panels[:columns], panels[columns:]
        draw_map(seen, episode, readings)
        for axes, family in zip(of_asked, asked, strict=True):
            draw_progress(axes, episode, family)
        _missed(missed, episode)
        rewards.plot(episode.time_s, episode.reward, color=MOTION)
        rewards.set(ylabel="reward: all that is heard", xlabel="time [s]")
        for axes in chances[1:]:
            axes.remove()
        _chances(chances[0], episode, readings)
        drawing.suptitle(f"{episode.families.named(episode.active_family[-1]).label}: told by the reward alone")


def _missed(axes: Axes, episode: EpisodeResult) -> None:
    """How far robot and belief are from the target, while the family is read rightly."""
    family, target = episode.last_family, np.array(episode.active_target[-1])
    read = _while_of(family, episode.inferred_family, episode.inferred_target)
    read[np.not_equal(episode.active_family, family.name)] = np.nan
    off = family.quantity.distance(read, target)
    axes.plot(episode.time_s, np.maximum(off, SMALLEST), ".", color=BELIEF, ms=4, label="belief")
    axes.plot(episode.time_s, np.maximum(episode.missed(), SMALLEST), color=MOTION, label="robot")
    axes.axhline(family.tolerance, color="0.7", lw=1.0, ls=":", label="tolerance")
    axes.set(
        yscale="log", xlabel="time [s]", ylabel=f"{family.quantity.label}: distance from the target [{family.unit}]"
    )


def _chances(axes: Axes, episode: EpisodeResult, readings: Sequence[Reading] | None) -> None:
    """Of each family; without readings which one was the likeliest."""
    named = dict.fromkeys(episode.inferred_family) if readings is None else readings[0].probabilities
    for name in named:
        of_family = np.equal(episode.inferred_family, name).astype(float)
        chances = of_family if readings is None else [reading.probabilities[name] for reading in readings]
        axes.plot(episode.time_s, chances, color=episode.families.named(name).colour, label=name)
    label = "likeliest family" if readings is None else "probability of each family"
    axes.set(xlabel="time [s]", ylabel=label, ylim=(-0.03, 1.03))


def draw_progress(axes: Axes, episode: EpisodeResult, family: Family, until: int | None = None) -> None:
    """What a family is about, up to a decision: reached, read from the belief, and true while it was asked."""
    time, reached = np.array(episode.time_s), episode.reached_of(family)
    if is_plane(family) and not is_place(family):
        reached = settled(family, reached)  # a gait would scribble all over
    wanted = _while_of(family, episode.active_family, episode.active_target)
    read = _while_of(family, episode.inferred_family, episode.inferred_target)
    spread = np.concatenate([reached, wanted[np.isfinite(wanted[:, 0])]])
    ends = [_ends(numbers) for numbers in spread.T]
    if is_plane(family):
        axes.plot(*wanted.T, "x", color=TRUTH, label="hidden target")
        axes.plot(*read[:until].T, ".", color=BELIEF, ms=4, label="read from the belief")
        axes.plot(*reached[:until].T, color=MOTION, lw=1.5, label="robot")
        set_plane(axes, family, *ends)
    elif is_heading(family):
        draw_circle(axes, time, reached[:, 0], wanted[:, 0], read[:, 0], until)
    else:
        for i, name in enumerate(components(family)):
            shade = SHADES[i % len(SHADES)]
            axes.plot(time, wanted[:, i], "--", color=TRUTH, alpha=shade, label=_once("hidden target", i))
            belief = {"color": BELIEF, "alpha": shade, "label": _once("read from the belief", i)}
            axes.plot(time[:until], read[:until, i], ".", ms=4, **belief)
            axes.plot(time[:until], reached[:until, i], color=MOTION, alpha=shade, lw=1.5, label=f"robot{name}")
        axes.set(xlabel="time [s]", ylabel=f"{family.name} [{family.unit}]", xlim=(0, time[-1]))
        axes.set(ylim=(min(low for low, _ in ends), max(high for _, high in ends)))
    axes.set_title(" ", fontsize=8)  # room for the legend, which must not push panels apart
    legend = axes.legend(
        loc="lower left", bbox_to_anchor=(0, 1), ncols=2 + family.size, frameon=False, fontsize=8, borderaxespad=0
    )
    legend.set_in_layout(False)


def set_plane(axes: Axes, family: Family, *ends: tuple[float, float]) -> None:
    """A metre as long in one direction as in the other, with these ends at least, if any are given."""
    across, up = (f"{name} [{family.unit}]" for name in family.quantity.components)
    axes.set(xlabel=across, ylabel=up)
    for set_ends, own in zip((axes.set_xlim, axes.set_ylim), ends, strict=False):
        set_ends(*own, auto=True)
    axes.set_aspect("equal", adjustable="datalim")


def components(family: Family) -> list[str]:
    """What tells the components of its target apart in a legend; nothing where there is one."""
    return [""] if family.size == 1 else [f" {name}" for name in family.quantity.components]


def _while_of(family: Family, named: list[str], vectors: list[list[float]]) -> Float[np.ndarray, "time size"]:
    """Vectors while they are of that family, else NaN."""
    nothing = [np.nan] * family.size
    return np.array([vector if name == family.name else nothing for name, vector in zip(named, vectors, strict=True)])


def _ends(numbers: Float[np.ndarray, " number"]) -> tuple[float, float]:
    """Of an axis."""
    margin = 0.15 * max(np.ptp(numbers), 1.0)
    return numbers.min() - margin, numbers.max() + margin


def _once(label: str, i: int) -> str | None:
    return label if i == 0 else None


def draw_trajectories(axes: Axes, episodes: list[EpisodeResult]) -> None:
    """What the robot did in episodes of one family, each target a dot of its colour at the end."""
    family, targets = episodes[0].last_family, np.array([episode.active_target[-1] for episode in episodes])
    largest = np.abs(targets[:, 0]).max() or 1.0
    for episode, target in zip(episodes, targets, strict=True):
        colour = plt.get_cmap(TASKS)(0.5 + 0.5 * target[0] / largest)
        if is_plane(family):
            axes.plot(*settled(family, episode.reached).T, color=colour, lw=1.2)
            axes.plot(*target, "o", color=colour, ms=4)
            continue
        if is_heading(family):
            draw_turn(axes, np.array(episode.time_s), episode.reached[:, 0], target[0], colour)
            continue
        for i, number in enumerate(target):
            axes.plot(episode.time_s, episode.reached[:, i], color=colour, alpha=SHADES[i % len(SHADES)], lw=1.2)
            axes.plot(episode.time_s[-1], number, MARKERS[i % len(MARKERS)], color=colour, ms=4, clip_on=False)
    if is_plane(family):
        set_plane(axes, family)
    elif is_heading(family):
        draw_rim(axes, episodes[0].time_s[-1])
    else:
        axes.set(xlabel="time [s]", ylabel=f"{family.name} [{family.unit}]")
    axes.set(title=f"{family.name}: robot (lines), targets (dots)")


def draw_beliefs(axes: Axes, results: Results) -> None:
    """The latents at the end."""
    is_plain = len(results.families) == 1 and results.families[0].size == 1
    if not is_plain and len(results.episodes[0].latent[0]) > 1:
        _kinds(axes, results)
    else:
        _latents(axes, results)


def _kinds(axes: Axes, results: Results) -> None:
    """Which of several families it is shows in the latent's first numbers."""
    for family in results.families:
        final = np.array([episode.latent[-1] for episode in results.of(family.name)])
        axes.plot(final[:, 0], final[:, 1], ".", color=family.colour, label=family.name)
    axes.set(xlabel="latent 1", ylabel="latent 2", title="the belief at the end: what kind of task")


def _latents(axes: Axes, results: Results) -> None:
    """The whole latent against the target's first number."""
    targets = [episode.active_target[-1][0] for episode in results.episodes]
    final = np.array([episode.latent[-1] for episode in results.episodes])
    for dimension in range(final.shape[1]):
        axes.plot(targets, final[:, dimension], ".", label=f"latent {dimension + 1}")
    axes.set(xlabel=f"hidden target [{results.families[0].unit}]", ylabel="latent mean", title="the belief at the end")


def draw_readings(axes: Axes, results: Results) -> None:
    """What a linear probe reads from the last belief, over what is true."""
    for family in results.families:
        of = results.of(family.name)
        truth = np.array([episode.active_target[-1] for episode in of])
        read = np.array([fit(np.array(episode.inferred_target[-1]), family.size) for episode in of])
        for i, name in enumerate(components(family)):
            label, marker = f"{family.name}{name} [{family.unit}]", MARKERS[i % len(MARKERS)]
            axes.plot(truth[:, i], read[:, i], marker, color=family.colour, mfc="none", label=label)
    axes.axline((0, 0), slope=1, color=TRUTH, lw=0.7)
    axes.set(xlabel="hidden target", ylabel="read from the belief", title="the belief at the end: how much")


def _errors(axes: Axes, agents: dict[str, list[EpisodeResult]], family: Family) -> None:
    colours = {"reuse": MOTION, "oracle": ORACLE, "idle": IDLE}
    for name, episodes in agents.items():
        draw_errors(axes, episodes, label=name, color=colours[name])
    axes.set(
        xlabel=f"{family.name}: final error [{family.unit}]",
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
