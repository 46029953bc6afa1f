"""Section 6.3 of the thesis: the toy, the flat policy, the naive transfer, striding."""

from pathlib import Path

import numpy as np
from matplotlib.patches import Circle

from rebody.agents.parts import load_flat, load_inference, load_tracker
from rebody.bodies import load_robot
from rebody.bodies.camera import Camera
from rebody.bodies.toy_models import mass_damper_model
from rebody.bodies.toys import MassDamper
from rebody.evaluation.evaluate import Trial
from rebody.report.style import BELIEF, ORACLE, TRUTH, figure
from rebody.report.thesis.data import Data, join, on_goals, split, training_log
from rebody.report.thesis.panels import (
    caption,
    draw_curve,
    draw_latents,
    draw_latents_over_targets,
    draw_level,
    draw_positions,
    smoothed,
)
from rebody.training.flat import FlatConfig, train_flat
from rebody.training.inference import PRESETS, train_inference
from rebody.training.tracker import tracker_preset, train_tracker

THESIS_GOALS = np.linspace(0.5, 10.0, 12)
GOALS = np.linspace(-10.0, 10.0, 12)
SECONDS = {1: 40.0, 10: 80.0, 50: 350.0, 100: 700.0}
"""Long enough for each stride [control steps] to arrive: it makes at most 0.1 m at a time."""
STRIDES = (10, 50, 100)
EPISODE = 25
"""Iterations that two episodes of the flat policy's training take; all its robots begin theirs at once."""


# 6.1


def toy_picture(_: Path) -> Data:
    """The toy as MuJoCo draws it."""
    model = mass_damper_model(MassDamper())
    camera = Camera(model, 480, 360)
    try:
        return {"picture": np.asarray(camera.picture(np.zeros(model.nq)))}
    finally:
        camera.close()


def draw_toy(data: Data, path: Path, text: str) -> None:
    """Picture and abstract model."""
    with figure(path, 1, 2, size=(9.0, 3.9)) as (drawing, (picture, model)):
        picture.imshow(data["picture"])
        picture.axis("off")
        model.add_patch(Circle((0, 0), 0.25, color="#2178b5"))
        model.axhline(-0.25, color=TRUTH, lw=1)
        for tip, tail, label, place in (
            ((1.1, 0), (0.25, 0), r"$F = 7\,\mathrm{N} \cdot a$", (0.55, 0.08)),
            ((-0.9, 0), (-0.25, 0), r"$-c\,\dot x$", (-0.75, 0.08)),
            ((0, -0.8), (0, 0), r"$-m\,g$", (0.06, -0.75)),
            ((0, 0.6), (0, -0.25), r"$N$", (0.06, 0.5)),
        ):
            model.annotate("", tip, tail, arrowprops={"arrowstyle": "-|>", "color": BELIEF, "lw": 1.8})
            model.text(*place, label, fontsize=11)
        model.annotate("", (-0.7, -0.55), (-1.2, -0.55), arrowprops={"arrowstyle": "->", "color": TRUTH})
        model.text(-0.68, -0.59, "$x$", fontsize=11)
        model.text(-1.25, 0.75, r"$m\,\ddot x = F - c\,\dot x$,  $m = 1$ kg, $c = 2$ N s/m", fontsize=11)
        model.set(xlim=(-1.3, 1.3), ylim=(-0.95, 0.95), aspect="equal")
        model.axis("off")
        caption(drawing, text)


# 6.2, 6.6, 6.7: training


def toy_training_log() -> Data:
    """Of the shipped module."""
    return training_log("position-thesis", "inference")


def train_toy(runs: Path) -> Data:
    """Of a module trained anew."""
    config, out = PRESETS["position-thesis"](), runs / "position-thesis"
    train_inference(config, out, 0, title="Inference: position-thesis", resume=True)
    return training_log(out, "inference")


def draw_toy_training(data: Data, path: Path, text: str) -> None:
    """Return over toy steps."""
    with figure(path, 1, 1, size=(7.5, 4.4)) as (drawing, (axes,)):
        draw_curve(axes, data, "return", "training episodes", colour="#9dbbd3")
        draw_curve(axes, data, "evaluation/return", "held-out goals", dots=True)
        draw_curve(axes, data, "evaluation/oracle return", "held-out goals, told", colour=ORACLE, dots=True)
        axes.set(xlabel="toy steps [million]", ylabel="return over 20 s")
        axes.legend(frameon=False)
        caption(drawing, text)


def flat_training_log() -> Data:
    """Of the shipped flat policy, whose log calls errors by other names."""
    of_today = {f"evaluation/{name} error": f"evaluation/goal {name}" for name in ("median", "p95")}
    return {of_today.get(name, name): values for name, values in training_log("flat-position-cheetah", "flat").items()}


def train_flat_again(runs: Path) -> Data:
    """Of a flat policy trained anew."""
    out = runs / "flat-position-cheetah"
    train_flat("cheetah", "position", FlatConfig(), out, 0, resume=True)
    return training_log(out, "flat")


def draw_flat_training(data: Data, path: Path, text: str) -> None:
    """Reward while exploring, error on held-out tasks."""
    with figure(path, 1, 2, size=(10.0, 4.2)) as (drawing, (rewards, errors)):
        draw_curve(rewards, smoothed(data, "task_reward", EPISODE), "task_reward", "while exploring")
        draw_level(rewards, -5.0, "standing still")
        rewards.set(xlabel="control steps [million]", ylabel="reward per decision [m]")
        draw_curve(errors, data, "evaluation/goal median", "median", dots=True)
        draw_curve(errors, data, "evaluation/goal p95", "95th percentile", colour=BELIEF, dots=True)
        draw_level(errors, 5.0, "standing still: median")
        errors.set(xlabel="control steps [million]", ylabel="final error [m]", yscale="log")
        for axes in (rewards, errors):
            axes.legend(frameon=False, fontsize=8)
        caption(drawing, text)


def tracker_training_log(robot: str) -> Data:
    """Of the shipped tracker."""
    return training_log(f"tracker-{robot}", "tracker")


def train_tracker_again(robot: str, runs: Path) -> Data:
    """Of a tracker trained anew, by its preset."""
    out = runs / f"tracker-{robot}"
    train_tracker(robot, tracker_preset(load_robot(robot)), out, 0, resume=True)
    return training_log(out, "tracker")


def draw_tracker_training(data: Data, path: Path, text: str) -> None:
    """Errors on held-out commands over control steps."""
    with figure(path, 1, 3, size=(14.0, 4.2)) as (drawing, panels):
        for axes, (slot, unit) in zip(panels, (("goal", "m"), ("velocity", "m/s"), ("stand", "rad")), strict=True):
            draw_curve(axes, data, f"evaluation/{slot} median", "median", dots=True)
            draw_curve(axes, data, f"evaluation/{slot} p95", "95th percentile", colour=BELIEF, dots=True)
            axes.set(xlabel="control steps [million]", ylabel=f"{slot}: final error [{unit}]", yscale="log")
            axes.legend(frameon=False, fontsize=8)
        caption(drawing, text)


# 6.3, 6.5: one set of episodes


def on_toy() -> Data:
    """`position-thesis` on the toy that it learned on."""
    return on_goals(Trial("reuse", load_inference("position-thesis"), None, None), THESIS_GOALS)


def flat_on_cheetah() -> Data:
    """The flat policy on the cheetah."""
    trial = Trial(
        "flat", load_inference("position"), load_robot("cheetah"), None, flat=load_flat("flat-position-cheetah")
    )
    return on_goals(trial, GOALS)


def draw_episodes(data: Data, path: Path, text: str) -> None:
    """Ways, latents, and latents over goals."""
    with figure(path, 1, 3, size=(12.0, 4.2)) as (drawing, (ways, latents, over_goals)):
        draw_positions(ways, data)
        draw_latents(latents, data)
        draw_latents_over_targets(over_goals, data)
        caption(drawing, text)


# 6.8, 6.9: strides


def thesis_on_cheetah(stride: int) -> Data:
    """`position-thesis` on the cheetah in thesis mode."""
    parts = load_inference("position-thesis"), load_robot("cheetah"), load_tracker("tracker-cheetah")
    trial = Trial("reuse", *parts, seconds=SECONDS[stride], stride=stride, horizon=1, thesis=True)
    return on_goals(trial, THESIS_GOALS)


def our_mode_on_cheetah() -> Data:
    """`position` on the cheetah, a decision every 0.1 s."""
    parts = load_inference("position"), load_robot("cheetah"), load_tracker("tracker-cheetah")
    return on_goals(Trial("reuse", *parts), THESIS_GOALS)


def strides_on_cheetah() -> Data:
    """Three strides, and our mode."""
    logs = {str(stride): thesis_on_cheetah(stride) for stride in STRIDES}
    return join(logs | {"ours": our_mode_on_cheetah()})


def draw_transfer(data: Data, path: Path, text: str) -> None:
    """Ways over seconds and decisions, latents, and latents over goals."""
    with figure(path, 2, 2, size=(10.0, 7.6)) as (drawing, (seconds, decisions, latents, over_goals)):
        draw_positions(seconds, data)
        draw_positions(decisions, data, against="decisions")
        draw_latents(latents, data)
        draw_latents_over_targets(over_goals, data)
        caption(drawing, text)


def draw_strides(data: Data, path: Path, text: str) -> None:
    """A column each: ways over seconds and decisions, latents over goals."""
    columns = {str(stride): f"stride {stride}" for stride in STRIDES} | {"ours": "our mode"}
    with figure(path, 3, len(columns), size=(15.0, 10.5)) as (drawing, panels):
        for i, (part, name) in enumerate(columns.items()):
            log = split(data, part)
            seconds, decisions, over_goals = panels[i :: len(columns)]
            draw_positions(seconds, log)
            draw_positions(decisions, log, against="decisions")
            draw_latents_over_targets(over_goals, log)
            seconds.set_title(name)
        caption(drawing, text)
