"""Section 6.4.3 of the thesis: the module for goals and speeds on robots that it has never seen."""

from pathlib import Path

from rebody.agents.parts import load_inference, load_slots_of, load_tracker
from rebody.bodies import load_robot
from rebody.evaluation.evaluate import Trial
from rebody.report.style import figure
from rebody.report.thesis.data import Data, trajectories
from rebody.report.thesis.panels import caption
from rebody.report.thesis.several_families import (
    in_plane,
    late_latents,
    on_toy,
    points_panel,
    tasks_of_each_kind,
    ways_panels,
)

MODULE = "goal-velocity"
DRAWN = ("time_s", "position_m", "velocity_m_s", "family", "target")


# 6.16 to 6.18


def on_robot(robot: str) -> Data:
    """`goal-velocity` on a robot, and its latents there and on the toy in the plane of the toy's main components."""
    from sklearn.decomposition import PCA  # a second to import, which every command would wait for

    module, spec = load_inference(MODULE), load_robot(robot)
    trial = Trial("reuse", module, spec, load_tracker(f"tracker-{robot}"), slots=load_slots_of(module, None))
    episodes = trajectories(trial, tasks_of_each_kind(spec.reach.speed))
    plane, on_the_toy = PCA(2), late_latents(on_toy())
    return {name: episodes[name] for name in DRAWN} | {
        "toy_pca": in_plane(on_the_toy, plane.fit_transform),
        "pca": in_plane(late_latents(episodes), plane.transform),
    }


def draw_robot(data: Data, path: Path, text: str) -> None:
    """Ways on goals and on speeds, and the latents."""
    with figure(path, 1, 3, size=(14.0, 4.6)) as (drawing, (positions, velocities, latents)):
        ways_panels(positions, velocities, data)
        latents.plot(*data["toy_pca"].reshape(-1, 2).T, ".", color="#d0d0d0", ms=7, label="on the toy")
        points_panel(latents, data["pca"], data)
        latents.legend(frameon=False, fontsize=8, markerscale=2)
        caption(drawing, text)
