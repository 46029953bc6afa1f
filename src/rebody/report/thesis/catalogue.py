"""Every figure by its number: where its log comes from, how it is drawn, and what is seen."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from rebody import names
from rebody.errors import RebodyError, unknown
from rebody.report.thesis import balancing, retrained, zero_shot
from rebody.report.thesis import first_experiment as first
from rebody.report.thesis import several_families as several
from rebody.report.thesis.data import Data, save, shipped


@dataclass(frozen=True)
class ThesisFigure:
    """One figure of the thesis."""

    number: str
    shipped: Callable[[], Data]
    """Its log out of the package."""
    rerun: Callable[[Path], Data]
    """Its log anew; training runs go into that folder, and are gone on with if they are there."""
    draw: Callable[[Data, Path, str], None]
    """Draws a log into a PNG with a caption."""
    caption: str
    """What is seen."""

    @property
    def title(self) -> str:
        """As `rebody list` has it."""
        return names.FIGURES[self.number]


def _positions(number: str, robot: str) -> ThesisFigure:
    return ThesisFigure(
        number,
        shipped(number),
        lambda _: balancing.positions_on(robot),
        balancing.draw_both,
        f"12 hidden goals in [0, 10] m on the {robot}, modules frozen. Above: `position-thesis` in thesis mode with a "
        "stride of 5 control steps (0.1 s), as in the thesis. Below: `position`, the toy imagined 15 decisions ahead. "
        "Left: the way (dots: goals), middle: the latent, right: the latent over the goal.",
    )


def _zero_shot(number: str, robot: str) -> ThesisFigure:
    return ThesisFigure(
        number,
        shipped(number),
        lambda _: zero_shot.with_latents(robot),
        zero_shot.draw_robot,
        f"`goal-velocity`, frozen, on the {robot} that took no part in its training, from x = 0 at rest. Left: goals, "
        "middle: speeds; dotted: what was hidden. Right: latents from the 20th decision on, in the plane of the two "
        "main components of the toy's (grey, the same tasks).",
    )


FIGURES = {
    figure.number: figure
    for figure in (
        ThesisFigure(
            "6.1",
            shipped("6.1"),
            first.toy_picture,
            first.draw_toy,
            "Left: the mass-damper toy as MuJoCo draws it. Right: what acts on it. The action is the share of the"
            " largest force; gravity is carried by the floor; terminal speed 3.5 m/s.",
        ),
        ThesisFigure(
            "6.2",
            first.toy_training_log,
            first.train_toy,
            first.draw_toy_training,
            "Return over 20 s while `position-thesis` learns: of episodes that act by their mean action, and of "
            "200 held-out goals; the oracle is the same learner, told the goal. Until the first joint iteration "
            "all toys wander, and only the inference module learns.",
        ),
        ThesisFigure(
            "6.3",
            shipped("6.3"),
            lambda _: first.on_toy(),
            first.draw_episodes,
            "12 hidden goals in [0, 10] m on the position toy (steps of at most 0.1 m). Left: the way (dots: "
            "goals) and the one-dimensional latent. Right: the latent over the goal, every decision of the second"
            " half.",
        ),
        ThesisFigure(
            "6.5",
            shipped("6.5"),
            lambda _: first.flat_on_cheetah(),
            first.draw_episodes,
            "The frozen module `position` on the cheetah with a policy that has no hierarchy in it (`flat-"
            "cheetah`): 12 hidden goals in +-10 m. It reaches them, but for the robot that stops halfway to -10 m"
            " and then takes it for a nearer one: a window of standing still says how far a goal is, not on which"
            " side.",
        ),
        ThesisFigure(
            "6.6",
            first.flat_training_log,
            first.train_flat_again,
            first.draw_flat_training,
            "Learning `flat-position-cheetah`. Left: the task's reward per decision while it explores, mean of two "
            "episodes. Right: final error on 100 held-out goals in +-10 m.",
        ),
        ThesisFigure(
            "6.7",
            lambda: first.tracker_training_log("cheetah"),
            lambda runs: first.train_tracker_again("cheetah", runs),
            first.draw_tracker_training,
            "Learning `tracker-cheetah`: errors on 100 held-out goals within 5 m, speeds of +-[0.3, 3] m/s and pitches "
            "of +-60 degrees, told to the tracker, at each dot.",
        ),
        ThesisFigure(
            "6.8",
            shipped("6.8"),
            lambda _: first.thesis_on_cheetah(1),
            first.draw_transfer,
            "`position-thesis`, frozen, on the cheetah in thesis mode with stride 1: 12 hidden goals in [0, 10] "
            "m. A control step takes the robot less far than a step takes the toy; it arrives late, some sway "
            "about the goal, and the latents are noisier than on the toy (figure 6.3).",
        ),
        ThesisFigure(
            "6.9",
            shipped("6.9"),
            lambda _: first.strides_on_cheetah(),
            first.draw_strides,
            "`position-thesis`, frozen, on the cheetah in thesis mode with strides of 10, 50 and 100 control "
            "steps (0.5, 2.5 and 5 s): counted in decisions all do as the toy does, in seconds a longer stride is"
            " slower by as much. Right: our mode, `position` with a decision every 0.1 s and the toy imagined 15 "
            "decisions ahead.",
        ),
        _positions("6.10", "hopper"),
        _positions("6.11", "walker"),
        ThesisFigure(
            "6.12",
            balancing.tracker_logs,
            balancing.train_trackers_again,
            balancing.draw_trackers,
            "Learning `tracker-hopper` and `tracker-walker`, means over 30 iterations. Left: pay per control step while"
            " they explore; the walker is told ever faster speeds over the first third. Right: how often they fall.",
        ),
        ThesisFigure(
            "6.13",
            several.training,
            several.train_again,
            several.draw_training,
            "Learning `goal-velocity` without labels: goals and speeds, front and back. Returns are over 20 s "
            "(training episodes begin anywhere, and in half of them the task changes). Below: components of the "
            "Dirichlet process mixture, and how they agree with the four base tasks, which nobody told. Front and "
            "back share a component: where components are the two families, purity and adjusted Rand index are 0.5.",
        ),
        ThesisFigure(
            "6.14a",
            shipped("6.14a"),
            lambda _: several.on_toy(),
            several.draw_ways,
            "`goal-velocity` on the mass-damper, from x = 0 at rest. Left: goals, right: speeds. Dotted: what was "
            "hidden.",
        ),
        ThesisFigure(
            "6.14b",
            shipped("6.14b"),
            lambda _: several.projections(),
            several.draw_projections,
            "Latents of `goal-velocity` from the 20th decision on, 12 tasks of each base task. Left: t-SNE, as in the "
            "thesis. Right: the two main components (PCA), where distances mean something.",
        ),
        ThesisFigure(
            "6.15",
            shipped("6.15"),
            lambda _: zero_shot.randomised(),
            zero_shot.draw_randomised,
            "Four modules, frozen, on the cheetah from x = 0 at rest. They differ in what disturbed the toy in "
            "training (noise: always; ripple, lag and gain: in half of the episodes). Left: goals, right: speeds; "
            "dotted: what was hidden.",
        ),
        _zero_shot("6.16", "cheetah"),
        _zero_shot("6.17", "walker"),
        _zero_shot("6.18", "hopper"),
        ThesisFigure(
            "6.19",
            retrained.training,
            retrained.train_again,
            retrained.draw_training,
            "Learning a high-level policy on a robot, its tracker and the module frozen: return over 20 s on 100 "
            "held-out tasks.",
        ),
        ThesisFigure(
            "6.20",
            shipped("6.20"),
            lambda _: retrained.on_robots(retrained.ON_CHEETAH),
            partial(retrained.draw_ways, retrained.ON_CHEETAH),
            "High-level policies that were learned on the cheetah, by module, from x = 0 at rest. Left: goals, right: "
            "speeds; dotted: what was hidden.",
        ),
        ThesisFigure(
            "6.21",
            shipped("6.21"),
            lambda _: retrained.on_robots(retrained.BALANCING),
            partial(retrained.draw_ways, retrained.BALANCING),
            "High-level policies that were learned on robots that have to balance, `goal-velocity` frozen, from x = 0 "
            "at rest. Left: goals, right: speeds; dotted: what was hidden.",
        ),
        ThesisFigure(
            "6.22",
            shipped("6.22"),
            lambda _: retrained.standing(),
            retrained.draw_standing,
            "A high-level policy that was learned on the cheetah, `goal-velocity-stand` frozen, from x = 0 at rest. "
            "Left: goals, middle: speeds, right: stands; dotted: what was hidden.",
        ),
    )
}


def find_figures(numbers: Sequence[str]) -> list[ThesisFigure]:
    """Figures by number, or `all`; RebodyError for one that there is not."""
    if not numbers:
        raise RebodyError(f"which figure? Figures are: {', '.join(FIGURES)}, or all.")
    if "all" in numbers:
        return list(FIGURES.values())
    for number in numbers:
        if number not in FIGURES:
            raise unknown("figure", number, FIGURES, "or all")
    return [FIGURES[number] for number in dict.fromkeys(numbers)]


def make_figure(figure: ThesisFigure, out: Path, *, rerun: bool) -> Path:
    """Draw a figure into the folder `out`, with its caption; returns the PNG's path.

    With `rerun` its log is made anew and written beside it.
    """
    out.mkdir(parents=True, exist_ok=True)
    path = out / f"{figure.number}.png"
    if rerun:
        data = figure.rerun(out / "runs")
        save(data, out / f"{figure.number}.safetensors")
    else:
        data = figure.shipped()
    source = "anew" if rerun else "from the log that ships"
    command = f"rebody figure {figure.number}" + (" --rerun" if rerun else "")
    figure.draw(data, path, f"{figure.caption}\nThesis, figure {figure.number}. Made by `{command}` ({source}).")
    return path
