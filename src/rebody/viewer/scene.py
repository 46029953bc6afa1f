"""The body in 3-D, with marks for what is hidden, what is believed and what the tracker is asked for."""

import copy
import math

import mujoco
import numpy as np
import viser
from jaxtyping import Float
from mjviser import ViserMujocoScene

from rebody.bodies import Simulation
from rebody.bodies.shown import shown, top_of
from rebody.tasks import FamilySet
from rebody.tasks.task_file import TaskSpec
from rebody.viewer import colours
from rebody.viewer.session import Moment

WORLD = "/fixed_bodies"
"""mjviser's frame of all that stands still. It is moved under the body, which stays in the middle of the picture."""
CAMERA, LOOKS_AT, FIELD_OF_VIEW = (0.0, -6.5, 1.8), (0.0, 0.0, 0.9), math.radians(42)
IN_PLANE = (-2.0, -4.6, 2.1), (0.0, 0.0, 0.45)
"""Camera of a body that may go anywhere, and what it looks at."""
MARKS = (colours.HIDDEN, colours.BELIEVED, colours.SUBGOAL)
HEIGHTS, ABOVE = np.array([1.8, 1.5, 1.2]), np.array([0.75, 0.5, 0.25])
"""Of marks; above the top of a body that may go anywhere [m]."""
EDGE_M = 2.0
"""Places farther away than this are off the picture: an arrow points to them [m]."""
ARROW_M = 0.5
"""Length of an arrow: of one to a place, and for every m/s of a speed [m]; twice that for a speed in the plane."""
SPEEDS = ("vx", "vy", "vz")
RULER_M, RULER_LABELS = 2, 7
"""From one label on the floor to the next [m], and how many there are."""


class Scene:
    """Everything in the 3-D view, which follows the body."""

    def __init__(self, server: viser.ViserServer, body: Simulation, families: FamilySet, in_plane: bool = False):
        server.scene.reset()
        camera = server.initial_camera
        camera.position, camera.look_at = IN_PLANE if in_plane else (CAMERA, LOOKS_AT)
        camera.fov, (model, _) = FIELD_OF_VIEW, shown(body.model, body.root)
        self._server, self._model, self._data = server, model, mujoco.MjData(model)
        self._body = ViserMujocoScene(server, copy.copy(model), num_envs=1)  # it changes how its model is drawn
        self._body.camera_tracking_enabled = False
        self._ruler = Ruler(server.scene, in_plane)
        heights = ABOVE + top_of(model, body.root) if in_plane else HEIGHTS
        marks = zip(("hidden", "believed", "subgoal"), MARKS, heights, strict=True)
        self._hidden, self._believed, self._subgoal = (
            Mark(server.scene, families, name, colour, float(height), in_plane) for name, colour, height in marks
        )

    def show_body(self, qpos: Float[np.ndarray, " nq"], where: Float[np.ndarray, " 2"]) -> None:
        """The body at these joint positions, the world moved so that this x and y [m] are in the middle."""
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, self._data)
        with self._server.atomic():
            middle = np.append(where, 0.0)
            places = self._data.xpos - middle
            self._body.update_from_arrays(places[None], self._data.xmat.reshape(1, -1, 3, 3))
            self._body.fixed_bodies_frame.position = tuple(-middle)
            self._ruler.show(where)

    def show_marks(self, task: TaskSpec, moment: Moment | None, where: Float[np.ndarray, " 2"]) -> None:
        """The hidden task, and what was believed and asked for at that moment; the body is at this x and y [m]."""
        reading = moment and moment.reading
        with self._server.atomic():
            self._hidden.show(task, where)
            self._believed.show(TaskSpec(reading.family, reading.target) if reading else None, where)
            self._subgoal.show(moment.subgoal if moment else None, where)


class Mark:
    """A target: a pole where a place is, an arrow for all else and to places that are far away."""

    def __init__(
        self, scene: viser.SceneApi, families: FamilySet, name: str, colour: str, height: float, in_plane: bool
    ):
        self._known, self._name, self._height, self._length = families, name, height, 2.0 if in_plane else 1.0
        shade = colours.rgb(colour)
        self._place = scene.add_frame(f"{WORLD}/{name}", show_axes=False, visible=False)
        # behind the body's path, the higher the farther, so that none hides another; in the plane the thinner
        behind, radius = (0.0, 0.02 / height) if in_plane else (0.4 * height, 0.025)
        middle, top = (0.0, behind, height / 2), (0.0, behind, height)
        scene.add_cylinder(f"{WORLD}/{name}/pole", radius, height, color=shade, position=middle)
        self._pole_label = scene.add_label(f"{WORLD}/{name}/label", name, position=top, anchor="bottom-center")
        self._arrow = scene.add_arrows(f"/{name}", np.zeros((1, 2, 3)), shade, visible=False)
        self._arrow_label = scene.add_label(f"/{name}/label", name)

    def show(self, target: TaskSpec | None, where: Float[np.ndarray, " 2"]) -> None:
        """That target, seen from a body at this x and y [m]; nothing where there is none."""
        if target is None:
            self._place.visible = self._arrow.visible = False
            return
        family = self._known.named(target.family)
        text = f"{self._name}: {family.name} {', '.join(f'{n:.1f}' for n in target.target)} {family.unit}"
        asked = dict(zip(family.quantity.components, target.target, strict=True))
        is_near = "x" in asked and math.hypot(*_towards(asked, where)) <= EDGE_M
        self._place.visible, self._arrow.visible = is_near, not is_near
        if is_near:
            self._place.position = (asked["x"], asked.get("y", 0.0), 0.0)
            self._pole_label.text = text
        else:
            start, along = _arrow(asked, where)
            start[2] += self._height
            along *= self._length if asked.keys() & {*SPEEDS} else 1.0
            self._arrow.points = np.array([[start, start + along]], np.float32)
            self._arrow_label.text, self._arrow_label.position = text, start
            self._arrow_label.anchor = "center-right" if along[0] >= 0 else "center-left"


def _towards(asked: dict[str, float], where: Float[np.ndarray, " 2"]) -> Float[np.ndarray, " 2"]:
    """From a body at this x and y to a place that is asked for [m]."""
    return np.array([asked["x"], asked.get("y", where[1])]) - where


def _arrow(
    asked: dict[str, float], where: Float[np.ndarray, " 2"]
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
    """Where an arrow begins, beside a body at this x and y [m], and how it goes on [m], for what is asked of its global
    state.
    """
    start = np.zeros(3)
    if "x" in asked:
        ahead = _towards(asked, where)
        direction = np.append(ahead / np.linalg.norm(ahead), 0.0)
        return EDGE_M * direction, ARROW_M * direction
    if asked.keys() & {*SPEEDS}:
        return start, ARROW_M * np.array([asked.get(name, 0.0) for name in SPEEDS])
    if asked.keys() & {"roll", "pitch"}:  # where the body's head is to be
        roll, pitch = asked.get("roll", 0.0), asked.get("pitch", 0.0)
        return start, np.array([math.cos(roll) * math.sin(pitch), -math.sin(roll), math.cos(roll) * math.cos(pitch)])
    if "yaw" in asked:
        return start, np.array([math.cos(asked["yaw"]), math.sin(asked["yaw"]), 0.0])
    return start, np.array([0.0, asked.get("y", 0.0), asked.get("z", 0.0)])


class Ruler:
    """Metres along the body's path, or in the plane along x beside it: labels on the floor, which move on as the body
    does.
    """

    def __init__(self, scene: viser.SceneApi, in_plane: bool):
        self._in_plane = in_plane
        self._labels = [
            scene.add_label(f"{WORLD}/ruler/{i}", "", anchor="top-center", font_screen_scale=0.8)
            for i in range(RULER_LABELS)
        ]

    def show(self, where: Float[np.ndarray, " 2"]) -> None:
        """Those that are nearest to this x and y [m]."""
        middle, beside = (round(number / RULER_M) for number in where.tolist())
        y = beside * RULER_M if self._in_plane else -0.5
        for mark in range(middle - RULER_LABELS // 2, middle + RULER_LABELS // 2 + 1):
            label = self._labels[mark % RULER_LABELS]
            x = mark * RULER_M
            label.text = f"({x}, {y}) m" if self._in_plane else f"{x} m"
            label.position = (x, y, 0.0)
