"""Sections 6.3.3 and 6.4.1 of the thesis: hidden positions on robots that have to balance, and their trackers."""

from pathlib import Path

from rebody.agents.parts import load_inference, load_tracker
from rebody.bodies import load_robot
from rebody.evaluation.evaluate import Trial
from rebody.report.style import BELIEF, MOTION, figure
from rebody.report.thesis.data import Data, join, on_goals, split
from rebody.report.thesis.first_experiment import THESIS_GOALS, tracker_training_log, train_tracker_again
from rebody.report.thesis.panels import (
    caption,
    draw_curve,
    draw_latents,
    draw_latents_over_targets,
    draw_positions,
    smoothed,
)

STRIDE = 5
"""Control steps of a decision in thesis mode: 0.1 s on these robots."""
MODES = {"thesis": f"`position-thesis`, thesis mode, stride {STRIDE}", "ours": "`position`, our mode"}
TRACKERS = {"hopper": MOTION, "walker": BELIEF}
ROWS = 30
"""Iterations whose mean is drawn."""


# 6.10, 6.11


def positions_on(robot: str) -> Data:
    """Both modules on a robot, each in its mode."""
    spec, tracker = load_robot(robot), load_tracker(f"tracker-{robot}")
    thesis = Trial("reuse", load_inference("position-thesis"), spec, tracker, stride=STRIDE, horizon=1, thesis=True)
    ours = Trial("reuse", load_inference("position"), spec, tracker)
    return join({"thesis": on_goals(thesis, THESIS_GOALS), "ours": on_goals(ours, THESIS_GOALS)})


def draw_both(data: Data, path: Path, text: str) -> None:
    """A row each: ways, latents, and latents over goals."""
    with figure(path, len(MODES), 3, size=(12.0, 8.0)) as (drawing, panels):
        for (mode, name), row in zip(MODES.items(), (panels[:3], panels[3:]), strict=True):
            log = split(data, mode)
            draw_positions(row[0], log)
            draw_latents(row[1], log)
            draw_latents_over_targets(row[2], log)
            row[0].set_title(name, fontsize=9, loc="left")
        caption(drawing, text)


# 6.12


def tracker_logs() -> Data:
    """Of the shipped trackers."""
    return join({robot: tracker_training_log(robot) for robot in TRACKERS})


def train_trackers_again(runs: Path) -> Data:
    """Of trackers trained anew by their presets."""
    return join({robot: train_tracker_again(robot, runs) for robot in TRACKERS})


def draw_trackers(data: Data, path: Path, text: str) -> None:
    """Pay and falls while they explore."""
    with figure(path, 1, 2, size=(10.0, 4.2)) as (drawing, (rewards, falls)):
        for robot, colour in TRACKERS.items():
            log = split(data, robot)
            for axes, name in ((rewards, "reward"), (falls, "falls_per_minute")):
                draw_curve(axes, smoothed(log, name, ROWS), name, robot, colour=colour)
        rewards.set(xlabel="control steps [million]", ylabel="reward per control step")
        falls.set(xlabel="control steps [million]", ylabel="falls per minute of a robot", yscale="log")
        for axes in (rewards, falls):
            axes.legend(frameon=False, fontsize=8)
        caption(drawing, text)
