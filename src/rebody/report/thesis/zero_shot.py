"""Section 6.4.3 of the thesis: modules for goals and speeds on robots that they have never seen."""

from pathlib import Path

from rebody.agents.parts import load_inference, load_slots_of, load_tracker
from rebody.bodies import load_robot
from rebody.evaluation.evaluate import Trial
from rebody.report.style import figure
from rebody.report.thesis.data import Data, join, trajectories
from rebody.report.thesis.panels import caption
from rebody.report.thesis.several_families import (
    draw_ways_of_each,
    in_plane,
    late_latents,
    on_toy,
    points_panel,
    tasks_of_each_kind,
    ways_panels,
)

MODULE = "goal-velocity"
DRAWN = ("time_s", "position_m", "velocity_m_s", "pitch_rad", "family", "target")
RANDOMISED = {
    "goal-velocity-noise-0": "nothing disturbed",
    "goal-velocity-noise-0.1": "observation noise of variance 0.1",
    "goal-velocity-noise-0.2": "observation noise of variance 0.2",
    "goal-velocity": "ripple, lag and gain",
}
"""Modules that differ in what disturbed the toy in their training."""


# 6.15


def randomised() -> Data:
    """Each of those modules on the cheetah."""
    return join({name: drawn(on_robot(name, "cheetah")) for name in RANDOMISED})


def draw_randomised(data: Data, path: Path, text: str) -> None:
    """A row per module."""
    draw_ways_of_each(data, {name: f"{name}: {disturbed}" for name, disturbed in RANDOMISED.items()}, path, text)


# 6.16 to 6.18


def with_latents(robot: str) -> Data:
    """`goal-velocity` on a robot, and its latents there and on the toy in the plane of the toy's main components."""
    from sklearn.decomposition import PCA  # a second to import, which every command would wait for

    episodes = on_robot(MODULE, robot)
    plane, on_the_toy = PCA(2), late_latents(on_toy())
    return drawn(episodes) | {
        "toy_pca": in_plane(on_the_toy, plane.fit_transform),
        "pca": in_plane(late_latents(episodes), plane.transform),
    }


def on_robot(module: str, robot: str) -> Data:
    """A module with the toy's policy on a robot, on tasks of each kind that the robot is fast enough for."""
    inference, spec = load_inference(module), load_robot(robot)
    trial = Trial("reuse", inference, spec, load_tracker(f"tracker-{robot}"), slots=load_slots_of(inference, None))
    return trajectories(trial, tasks_of_each_kind(spec.reach))


def draw_robot(data: Data, path: Path, text: str) -> None:
    """Ways on goals and on speeds, and the latents."""
    with figure(path, 1, 3, size=(14.0, 4.6)) as (drawing, (positions, velocities, latents)):
        ways_panels((positions, velocities), data)
        latents.plot(*data["toy_pca"].reshape(-1, 2).T, ".", color="#d0d0d0", ms=7, label="on the toy")
        points_panel(latents, data["pca"], data)
        latents.legend(frameon=False, fontsize=8, markerscale=2)
        caption(drawing, text)


def drawn(episodes: Data) -> Data:
    """What the figures need of episodes."""
    return {name: episodes[name] for name in DRAWN}
