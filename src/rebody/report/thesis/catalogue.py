"""Every figure by its number: where its log comes from, how it is drawn, and what is seen."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from rebody import names
from rebody.errors import RebodyError, unknown
from rebody.report.style import figure
from rebody.report.thesis import data, episodes, learning, panels
from rebody.report.thesis.data import Data
from rebody.report.thesis.learning import HIGH_LEVELS, title_of
from rebody.report.thesis.panels import Panel
from rebody.report.thesis.trainings import logs_of, train_again, training_log
from rebody.tasks.line import GOAL, STAND, VELOCITY

WIDTHS = {1: 7.5, 2: 10.5, 3: 13.0, 4: 15.0}
"""Of figures with so many columns [inches]."""


@dataclass(frozen=True)
class ThesisFigure:
    """One figure of the thesis."""

    number: str
    log: Callable[[], Data] | tuple[str, ...]
    """What makes its log, which ships; or artifacts, whose training logs it is drawn from."""
    rows: Sequence[Sequence[Panel]]
    caption: str
    """What is seen."""

    @property
    def title(self) -> str:
        """As `rebody list` has it."""
        return names.FIGURES[self.number]

    def shipped(self) -> Data:
        """Its log out of the package."""
        return logs_of(self.log, training_log) if isinstance(self.log, tuple) else data.shipped(self.number)

    def rerun(self, runs: Path) -> Data:
        """Its log anew; training runs go into that folder, and are gone on with if they are there."""
        return logs_of(self.log, partial(train_again, runs=runs)) if isinstance(self.log, tuple) else self.log()

    def draw(self, log: Data, path: Path, text: str) -> None:
        """Draw a log into a PNG with a caption."""
        rows, columns = len(self.rows), len(self.rows[0])
        with figure(path, rows, columns, size=(WIDTHS[columns], 1.0 + 3.5 * rows)) as (drawing, axes):
            for panel, of_panel in zip((panel for row in self.rows for panel in row), axes, strict=True):
                panel(of_panel, log)
            panels.caption(drawing, text)


POSITIONS = (panels.draw_positions, panels.draw_latents, panels.draw_latents_over_targets)
BY_DECISIONS = partial(panels.draw_positions, against="decisions")
WAYS = (panels.ways(GOAL), panels.ways(VELOCITY))
RANDOMISED = {
    "goal-velocity-noise-0": "nothing disturbed",
    "goal-velocity-noise-0.1": "observation noise of variance 0.1",
    "goal-velocity-noise-0.2": "observation noise of variance 0.2",
    "goal-velocity": "ripple, lag and gain",
}
"""Modules that differ in what disturbed the toy in their training."""
ON_CHEETAH = ("high-level-goal-velocity-cheetah", "high-level-goal-velocity-noise-0-cheetah")
BALANCING = ("high-level-goal-velocity-walker", "high-level-goal-velocity-hopper")
STANDING = "high-level-goal-velocity-stand-cheetah"


def _positions(number: str, robot: str) -> ThesisFigure:
    stride = episodes.BALANCING_STRIDE
    titles = {"thesis": f"`position-thesis`, thesis mode, stride {stride}", "ours": "`position`, our mode"}
    return ThesisFigure(
        number,
        lambda: episodes.positions_on(robot),
        panels.rows_of(titles, POSITIONS),
        f"12 hidden goals in [0, 10] m on the {robot}, modules frozen. Above: `position-thesis` in thesis mode with a "
        "stride of 5 control steps (0.1 s), as in the thesis. Below: `position`, the toy imagined 15 decisions ahead. "
        "Left: the way (dots: goals), middle: the latent, right: the latent over the goal.",
    )


def _zero_shot(number: str, robot: str) -> ThesisFigure:
    return ThesisFigure(
        number,
        lambda: episodes.with_latents(robot),
        ((*WAYS, panels.points("pca", behind="toy_pca")),),
        f"`goal-velocity`, frozen, on the {robot} that took no part in its training, from x = 0 at rest. Left: goals, "
        "middle: speeds; dotted: what was hidden. Right: latents from the 20th decision on, in the plane of the two "
        "main components of the toy's (grey, the same tasks).",
    )


def _retrained(policies: Iterable[str]) -> Data:
    return data.join({name: episodes.retrained(name) for name in policies})


FIGURES = {
    figure.number: figure
    for figure in (
        ThesisFigure(
            "6.1",
            episodes.toy_picture,
            ((panels.draw_picture, panels.draw_forces),),
            "Left: the mass-damper toy as MuJoCo draws it. Right: what acts on it. The action is the share of the "
            "largest force; gravity is carried by the floor; terminal speed 3.5 m/s.",
        ),
        ThesisFigure(
            "6.2",
            ("position-thesis",),
            learning.TOY,
            "Return over 20 s while `position-thesis` learns: of episodes that act by their mean action, and of 200 "
            "held-out goals; the oracle is the same learner, told the goal. Until the first joint iteration all toys "
            "wander, and only the inference module learns.",
        ),
        ThesisFigure(
            "6.3",
            episodes.position_on_toy,
            (POSITIONS,),
            "12 hidden goals in [0, 10] m on the position toy (steps of at most 0.1 m). Left: the way (dots: goals) "
            "and the one-dimensional latent. Right: the latent over the goal, every decision of the second half.",
        ),
        ThesisFigure(
            "6.5",
            episodes.flat_on_cheetah,
            (POSITIONS,),
            "The frozen module `position` on the cheetah with a policy that has no hierarchy in it (`flat-cheetah`): "
            "12 hidden goals in +-10 m. It reaches them, but for the robot that stops halfway to -10 m and then takes "
            "it for a nearer one: a window of standing still says how far a goal is, not on which side.",
        ),
        ThesisFigure(
            "6.6",
            ("flat-position-cheetah",),
            learning.FLAT,
            "Learning `flat-position-cheetah`. Left: the task's reward per decision while it explores, mean of two "
            "episodes. Right: final error on 100 held-out goals in +-10 m.",
        ),
        ThesisFigure(
            "6.7",
            ("tracker-cheetah",),
            learning.TRACKER,
            "Learning `tracker-cheetah`: errors on 100 held-out goals within 5 m, speeds of +-[0.3, 3] m/s and pitches"
            " of +-60 degrees, told to the tracker, at each dot.",
        ),
        ThesisFigure(
            "6.8",
            lambda: episodes.thesis_on("cheetah", 1),
            ((panels.draw_positions, BY_DECISIONS), POSITIONS[1:]),
            "`position-thesis`, frozen, on the cheetah in thesis mode with stride 1: 12 hidden goals in [0, 10] m. A "
            "control step takes the robot less far than a step takes the toy; it arrives late, some sway about the "
            "goal, and the latents are noisier than on the toy (figure 6.3).",
        ),
        ThesisFigure(
            "6.9",
            episodes.strides_on_cheetah,
            tuple(
                zip(
                    *panels.rows_of(
                        {str(stride): f"stride {stride}" for stride in episodes.STRIDES} | {"ours": "our mode"},
                        (panels.draw_positions, BY_DECISIONS, panels.draw_latents_over_targets),
                    ),
                    strict=True,
                )
            ),
            "`position-thesis`, frozen, on the cheetah in thesis mode with strides of 10, 50 and 100 control steps "
            "(0.5, 2.5 and 5 s): counted in decisions all do as the toy does, in seconds a longer stride is slower by "
            "as much. Right: our mode, `position` with a decision every 0.1 s and the toy imagined 15 decisions ahead.",
        ),
        _positions("6.10", "hopper"),
        _positions("6.11", "walker"),
        ThesisFigure(
            "6.12",
            ("tracker-hopper", "tracker-walker"),
            learning.TRACKERS,
            "Learning `tracker-hopper` and `tracker-walker`, means over 30 iterations. Left: pay per control step "
            "while they explore; the walker is told ever faster speeds over the first third. Right: how often they "
            "fall.",
        ),
        ThesisFigure(
            "6.13",
            ("goal-velocity",),
            learning.SEVERAL,
            "Learning `goal-velocity` without labels: goals and speeds, front and back. Returns are over 20 s "
            "(training episodes begin anywhere, and in half of them the task changes). Below: components of the "
            "Dirichlet process mixture, and how they agree with the four base tasks, which nobody told. Front and back"
            " share a component: where components are the two families, purity and adjusted Rand index are 0.5.",
        ),
        ThesisFigure(
            "6.14a",
            episodes.on_toy,
            (WAYS,),
            "`goal-velocity` on the mass-damper, from x = 0 at rest. Left: goals, right: speeds. Dotted: what was "
            "hidden.",
        ),
        ThesisFigure(
            "6.14b",
            episodes.projections,
            ((panels.points("tsne", "t-SNE"), panels.points("pca", "PCA")),),
            "Latents of `goal-velocity` from the 20th decision on, 12 tasks of each base task. Left: t-SNE, as in the "
            "thesis. Right: the two main components (PCA), where distances mean something.",
        ),
        ThesisFigure(
            "6.15",
            lambda: episodes.randomised(RANDOMISED),
            panels.rows_of({name: f"{name}: {disturbed}" for name, disturbed in RANDOMISED.items()}, WAYS),
            "Four modules, frozen, on the cheetah from x = 0 at rest. They differ in what disturbed the toy in "
            "training (noise: always; ripple, lag and gain: in half of the episodes). Left: goals, right: speeds; "
            "dotted: what was hidden.",
        ),
        _zero_shot("6.16", "cheetah"),
        _zero_shot("6.17", "walker"),
        _zero_shot("6.18", "hopper"),
        ThesisFigure(
            "6.19",
            tuple(HIGH_LEVELS),
            learning.RETRAINED,
            "Learning a high-level policy on a robot, its tracker and the module frozen: return over 20 s on 100 "
            "held-out tasks.",
        ),
        ThesisFigure(
            "6.20",
            lambda: _retrained(ON_CHEETAH),
            panels.rows_of({name: title_of(name) for name in ON_CHEETAH}, WAYS),
            "High-level policies that were learned on the cheetah, by module, from x = 0 at rest. Left: goals, right: "
            "speeds; dotted: what was hidden.",
        ),
        ThesisFigure(
            "6.21",
            lambda: _retrained(BALANCING),
            panels.rows_of({name: title_of(name) for name in BALANCING}, WAYS),
            "High-level policies that were learned on robots that have to balance, `goal-velocity` frozen, from x = 0 "
            "at rest. Left: goals, right: speeds; dotted: what was hidden.",
        ),
        ThesisFigure(
            "6.22",
            lambda: episodes.retrained(STANDING),
            (tuple(map(panels.ways, (GOAL, VELOCITY, STAND))),),
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
    log = figure.rerun(out / "runs") if rerun else figure.shipped()
    if rerun:
        data.save(log, out / f"{figure.number}.safetensors")
    source = "anew" if rerun else "from the log that ships"
    command = f"rebody figure {figure.number}" + (" --rerun" if rerun else "")
    figure.draw(log, path, f"{figure.caption}\nThesis, figure {figure.number}. Made by `{command}` ({source}).")
    return path
