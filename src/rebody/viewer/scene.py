"""The body in 3-D, with marks for what is hidden, what is believed and what the tracker is asked for."""

import copy
import math

import mujoco
import numpy as np
import viser
from jaxtyping import Float
from mjviser import ViserMujocoScene

from rebody.tasks import FAMILIES, GOAL, JUMP, STAND, VELOCITY, family_index
from rebody.tasks.task_file import TaskSpec
from rebody.viewer import colours
from rebody.viewer.session import Moment

WORLD = "/fixed_bodies"
"""mjviser's frame of all that stands still. It is moved under the body, which stays in the middle of the picture."""
CAMERA, LOOKS_AT, FIELD_OF_VIEW = (0.0, -6.5, 1.8), (0.0, 0.0, 0.9), math.radians(42)
EDGE_M = 2.0
"""Goals farther away than this are off the picture: an arrow points to them [m]."""
ARROW_M = 0.5
"""Length of an arrow: of one to a goal, and for every m/s of a speed [m]."""
RULER_M, RULER_LABELS = 2, 7
"""From one label on the floor to the next [m], and how many there are."""


class Scene:
    """Everything in the 3-D view, which follows the body along x."""

    def __init__(self, server: viser.ViserServer, model: mujoco.MjModel):
        server.scene.reset()
        camera = server.initial_camera
        camera.position, camera.look_at, camera.fov = CAMERA, LOOKS_AT, FIELD_OF_VIEW
        self._server, self._model, self._data = server, model, mujoco.MjData(model)
        self._body = ViserMujocoScene(server, copy.copy(model), num_envs=1)  # it changes how its model is drawn
        self._body.camera_tracking_enabled = False
        self._ruler = Ruler(server.scene)
        self._hidden = Mark(server.scene, "hidden", colours.HIDDEN, 1.8)
        self._believed = Mark(server.scene, "believed", colours.BELIEVED, 1.5)
        self._subgoal = Mark(server.scene, "subgoal", colours.SUBGOAL, 1.2)

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
    """A target: a pole where a goal is, an arrow for all else and to goals that are far away."""

    def __init__(self, scene: viser.SceneApi, name: str, colour: str, height: float):
        self._name, self._height = name, height
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
        family = family_index(target.family)
        text = f"{self._name}: {target.family} {target.target:.1f} {FAMILIES[family].unit}"
        is_near = family == GOAL and abs(target.target - x) <= EDGE_M
        self._place.visible, self._arrow.visible = is_near, not is_near
        if is_near:
            self._place.position = (target.target, 0.0, 0.0)
            self._pole_label.text = text
        else:
            start, along = _arrow(family, target.target, x)
            start[2] += self._height
            self._arrow.points = np.array([[start, start + along]], np.float32)
            self._arrow_label.text, self._arrow_label.position = text, start
            self._arrow_label.anchor = "center-right" if along[0] >= 0 else "center-left"


def _arrow(family: int, target: float, x: float) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
    """Where an arrow begins, beside a body at x [m], and how it goes on [m]."""
    start = np.zeros(3)
    if family == VELOCITY:
        return start, np.array([ARROW_M * target, 0.0, 0.0])
    if family == JUMP:
        return start, np.array([0.0, 0.0, ARROW_M * target])
    if family == STAND:
        return start, np.array([math.sin(target), 0.0, math.cos(target)])
    side = math.copysign(1.0, target - x)
    start[0] = side * EDGE_M
    return start, np.array([side * ARROW_M, 0.0, 0.0])


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
