"""Pictures of a body, with a camera that follows it; a display is not needed."""

import ctypes
import importlib
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import mujoco
import mujoco.rendering.classic.gl_context as gl_context
import numpy as np
from jaxtyping import Float, UInt8

from rebody.bodies.model import carried_by
from rebody.bodies.shown import shown
from rebody.errors import RebodyError

NOT_DRAWN = (RuntimeError, mujoco.FatalError, ImportError, AttributeError)
"""What MuJoCo and PyOpenGL raise where OpenGL is switched off (MUJOCO_GL=off), missing, or has no display."""

SIZES_AWAY = 3.0
"""Distance of a camera that is ours, in sizes of the body."""
AROUND_AWAY = 5.0
"""The same where the floor about it is shown."""
Colour = tuple[float, float, float, float]
"""Red, green, blue, opacity."""


@dataclass(frozen=True)
class Pole:
    """An upright mark: at a place, or beside the path of a body that moves along x."""

    x: float  # m
    colour: Colour
    y: float = 0.6  # m
    radius: float = 0.03  # m


class Camera:
    """Draws a model from its own camera `track`, or from the side where it has none that moves with the body."""

    def __init__(self, model: mujoco.MjModel, width: int = 640, height: int = 480, root: int = 1, around: bool = False):
        """Size in pixels; `root` is the id of the body that is followed, `around` shows more of the floor about it.

        RebodyError where nothing can be drawn.
        """
        model, has_gaps = _drawable(model, width, height, root, around)
        self._data = mujoco.MjData(model)
        self._root = root
        self._view = _view(model, root, around)
        self._option = mujoco.MjvOption()
        self._option.flags[mujoco.mjtVisFlag.mjVIS_AUTOCONNECT] = has_gaps
        try:
            choose_opengl()
            self._renderer = mujoco.Renderer(model, height, width)
        except NOT_DRAWN as error:
            raise RebodyError(
                "MuJoCo could not draw here. Set MUJOCO_GL to egl or osmesa (install libegl1 or libosmesa6), "
                "or to glfw where there is a display."
            ) from error

    def picture(
        self, qpos: Float[np.ndarray, " nq"], poles: Sequence[Pole] = ()
    ) -> UInt8[np.ndarray, "height width 3"]:
        """The body at these joint positions, with poles that mark places."""
        self._data.qpos[:] = qpos
        mujoco.mj_forward(self._renderer.model, self._data)
        if self._view.type == mujoco.mjtCamera.mjCAMERA_FREE:
            self._view.lookat[:] = self._data.xpos[self._root]
        self._renderer.update_scene(self._data, self._view, self._option)
        self._renderer.scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False  # halves the time of a frame
        for pole in poles:
            _plant(self._renderer.scene, pole)
        return self._renderer.render()

    def close(self) -> None:
        """Release what OpenGL holds; may be called twice."""
        self._renderer.close()


def _view(model: mujoco.MjModel, root: int, around: bool) -> mujoco.MjvCamera:
    """The model's camera `track`, unless it stays where it is; else one beside the body, at a distance for its size."""
    view = mujoco.MjvCamera()
    track = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA, "track")
    if not around and track >= 0 and model.cam_bodyid[track] != 0:
        view.type, view.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, track
        return view
    view.type, size = mujoco.mjtCamera.mjCAMERA_FREE, _size(model, root)
    away, view.elevation = (AROUND_AWAY, -28.0) if around else (SIZES_AWAY, -15.0)
    view.azimuth, view.distance = 90.0, away * size
    model.stat.extent = min(model.stat.extent, away * size)  # what is nearer than a share of it is not drawn
    return view


def _size(model: mujoco.MjModel, root: int) -> float:
    """How far a body's parts reach from its origin as they are modelled [m]; that of the whole model if it has none.

    A floor may be a box as large as a field, and counts in MuJoCo's own extent.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    own = carried_by(model, root)[model.geom_bodyid]
    reach = np.linalg.norm(data.geom_xpos[own] - data.xpos[root], axis=-1) + model.geom_rbound[own]
    return float(reach.max(initial=0.0)) or model.stat.extent


def _plant(scene: mujoco.MjvScene, pole: Pole) -> None:
    geom = scene.geoms[scene.ngeom]
    size, place = np.array([pole.radius, 0.6, 0.0]), np.array([pole.x, pole.y, 0.6])
    colour = np.array(pole.colour, np.float32)
    mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_CYLINDER, size, place, np.eye(3).ravel(), colour)
    scene.ngeom += 1


def choose_opengl() -> None:
    """Without a display, tell MuJoCo to draw with EGL, else with OSMesa; MUJOCO_GL has precedence."""
    if not _needs_offscreen(os.environ):
        return
    os.environ["MUJOCO_GL"] = "egl" if _loads("libEGL.so.1") else "osmesa"
    importlib.reload(gl_context)  # it chose when MuJoCo was imported, which may have been before us


def _needs_offscreen(environment: Mapping[str, str]) -> bool:
    chosen = {"MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY"} & environment.keys()
    return sys.platform == "linux" and not chosen


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _drawable(model: mujoco.MjModel, width: int, height: int, root: int, around: bool) -> tuple[mujoco.MjModel, bool]:
    """A copy with room for the picture, in the light, on a floor without end, and whether the robot has gaps.

    Gymnasium's floors end after 40 m for the eye only; a robot runs further.
    """
    model, has_gaps = shown(model, root)
    buffer, lamp = model.vis.global_, model.vis.headlight
    buffer.offwidth, buffer.offheight = max(buffer.offwidth, width), max(buffer.offheight, height)
    if not model.nlight:  # MuJoCo's headlight alone leaves it in the dark
        lamp.ambient[:], lamp.diffuse[:] = 0.4, 0.6
    elif around:  # lamps of a scene stay where they are, and a robot walks out of their light
        model.light_diffuse *= 0.4
        lamp.ambient[:], lamp.diffuse[:] = 0.35, 0.45
    ends = (model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE) & (model.geom_size[:, 0] > 0)
    for plane in np.flatnonzero(ends):
        if (material := model.geom_matid[plane]) >= 0:
            # an endless plane counts its texture's repeats per metre
            model.mat_texrepeat[material] /= 2 * model.geom_size[plane, :2]
        model.geom_size[plane, :2] = 0.0
    return model, has_gaps
