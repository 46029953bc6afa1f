"""The body in 3-D, with marks for what is hidden, what is believed and what the tracker is asked for."""

import copy
import math

import mujoco
import numpy as np
import viser
from jaxtyping import Float
from mjviser import ViserMujocoScene

from rebody.tasks import FamilySet
from rebody.tasks.task_file import TaskSpec
from rebody.viewer import colours
from rebody.viewer.session import Moment

WORLD = "/fixed_bodies"
"""mjviser's frame of all that stands still. It is moved under the body, which stays in the middle of the picture."""
CAMERA, LOOKS_AT, FIELD_OF_VIEW = (0.0, -6.5, 1.8), (0.0, 0.0, 0.9), math.radians(42)
EDGE_M = 2.0
"""Places farther away than this are off the picture: an arrow points to them [m]."""
ARROW_M = 0.5
"""Length of an arrow: of one to a place, and for every m/s of a speed [m]."""
SPEEDS = ("vx", "vy", "vz")
RULER_M, RULER_LABELS = 2, 7
"""From one label on the floor to the next [m], and how many there are."""


class Scene:
    """Everything in the 3-D view, which follows the body along x."""

    def __init__(self, server: viser.ViserServer, model: mujoco.MjModel, families: FamilySet):
        server.scene.reset()
        camera = server.initial_camera
        camera.position, camera.look_at, camera.fov = CAMERA, LOOKS_AT, FIELD_OF_VIEW
        self._server, self._model, self._data = server, model, mujoco.MjData(model)
        self._body = ViserMujocoScene(server, copy.copy(model), num_envs=1)  # it changes how its model is drawn
        self._body.camera_tracking_enabled = False
        self._ruler = Ruler(server.scene)
        self._hidden = Mark(server.scene, families, "hidden", colours.HIDDEN, 1.8)
        self._believed = Mark(server.scene, families, "believed", colours.BELIEVED, 1.5)
        self._subgoal = Mark(server.scene, families, "subgoal", colours.SUBGOAL, 1.2)

    def show_body(self, qpos: Float[np.ndarray, " nq"], x: float) -> None:
        """The body at these joint positions, the world moved so that x [m] is in the middle."""
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, self._data)
        with self._server.atomic():
            places = self._data.xpos - [x, 0.0, 0.0]
            self._body.update_from_arrays(places[None], self._data.xmat.reshape(1, -1, 3, 3))
            self._body.fixed_bodies_frame.position = (-x, 0.0, 0.0)
            self._ruler.show(x)

    def show_marks(self, task: TaskSpec, moment: Moment | None, x: float) -> None:
        """The hidden task, and what was believed and asked for at that moment; the body is at x [m]."""
        reading = moment and moment.reading
        with self._server.atomic():
            self._hidden.show(task, x)
            self._believed.show(TaskSpec(reading.family, reading.target) if reading else None, x)
            self._subgoal.show(moment.subgoal if moment else None, x)


class Mark:
    """A target: a pole where a place is, an arrow for all else and to places that are far away."""

    def __init__(self, scene: viser.SceneApi, families: FamilySet, name: str, colour: str, height: float):
        self._known, self._name, self._height = families, name, height
        shade = colours.rgb(colour)
        self._place = scene.add_frame(f"{WORLD}/{name}", show_axes=False, visible=False)
        behind = 0.4 * height  # the body's path; the higher the farther, so that none hides another
        middle, top = (0.0, behind, height / 2), (0.0, behind, height)
        scene.add_cylinder(f"{WORLD}/{name}/pole", 0.025, height, color=shade, position=middle)
        self._pole_label = scene.add_label(f"{WORLD}/{name}/label", name, position=top, anchor="bottom-center")
        self._arrow = scene.add_arrows(f"/{name}", np.zeros((1, 2, 3)), shade, visible=False)
        self._arrow_label = scene.add_label(f"/{name}/label", name)

    def show(self, target: TaskSpec | None, x: float) -> None:
        """That target, seen from a body at x [m]; nothing where there is none."""
        if target is None:
            self._place.visible = self._arrow.visible = False
            return
        family = self._known.named(target.family)
        text = f"{self._name}: {family.name} {', '.join(f'{n:.1f}' for n in target.target)} {family.unit}"
        asked = dict(zip(family.quantity.components, target.target, strict=True))
        is_near = "x" in asked and abs(asked["x"] - x) <= EDGE_M
        self._place.visible, self._arrow.visible = is_near, not is_near
        if is_near:
            self._place.position = (asked["x"], asked.get("y", 0.0), 0.0)
            self._pole_label.text = text
        else:
            start, along = _arrow(asked, x)
            start[2] += self._height
            self._arrow.points = np.array([[start, start + along]], np.float32)
            self._arrow_label.text, self._arrow_label.position = text, start
            self._arrow_label.anchor = "center-right" if along[0] >= 0 else "center-left"


def _arrow(asked: dict[str, float], x: float) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
    """Where an arrow begins, beside a body at x [m], and how it goes on [m], for what is asked of its global state."""
    start = np.zeros(3)
    if "x" in asked:
        side = math.copysign(1.0, asked["x"] - x)
        start[0] = side * EDGE_M
        return start, np.array([side * ARROW_M, 0.0, 0.0])
    if asked.keys() & {*SPEEDS}:
        return start, ARROW_M * np.array([asked.get(name, 0.0) for name in SPEEDS])
    if asked.keys() & {"roll", "pitch"}:  # where the body's head is to be
        roll, pitch = asked.get("roll", 0.0), asked.get("pitch", 0.0)
        return start, np.array([math.cos(roll) * math.sin(pitch), -math.sin(roll), math.cos(roll) * math.cos(pitch)])
    if "yaw" in asked:
        return start, np.array([math.cos(asked["yaw"]), math.sin(asked["yaw"]), 0.0])
    return start, np.array([0.0, asked.get("y", 0.0), asked.get("z", 0.0)])


class Ruler:
    """Metres along the body's path: labels on the floor, which move on as the body does."""

    def __init__(self, scene: viser.SceneApi):
        self._labels = [
            scene.add_label(f"{WORLD}/ruler/{i}", "", anchor="top-center", font_screen_scale=0.8)
            for i in range(RULER_LABELS)
        ]

    def show(self, x: float) -> None:
        """Those that are nearest to x [m]."""
        middle = round(x / RULER_M)
        for mark in range(middle - RULER_LABELS // 2, middle + RULER_LABELS // 2 + 1):
            label = self._labels[mark % RULER_LABELS]
            label.text = f"{mark * RULER_M} m"
            label.position = (mark * RULER_M, -0.5, 0.0)
