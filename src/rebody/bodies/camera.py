"""Pictures of a body, with a camera that follows it; a display is not needed."""

import copy
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

from rebody.errors import RebodyError

NOT_DRAWN = (RuntimeError, mujoco.FatalError, ImportError, AttributeError)
"""What MuJoCo and PyOpenGL raise where OpenGL is switched off (MUJOCO_GL=off), missing, or has no display."""


@dataclass(frozen=True)
class Pole:
    """An upright mark beside the body's path."""

    x: float  # m
    colour: tuple[float, float, float, float]  # red, green, blue, opacity


class Camera:
    """Draws a model from the camera that it calls `track`."""

    def __init__(self, model: mujoco.MjModel, width: int = 640, height: int = 480):
        """Size in pixels, at most the model's offscreen buffer; RebodyError where nothing can be drawn."""
        model = _with_endless_floor(model)
        self._data = mujoco.MjData(model)
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
        """The body at these joint positions, with poles that mark places along x."""
        self._data.qpos[:] = qpos
        mujoco.mj_forward(self._renderer.model, self._data)
        self._renderer.update_scene(self._data, "track")
        self._renderer.scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False  # halves the time of a frame
        for pole in poles:
            _plant(self._renderer.scene, pole)
        return self._renderer.render()

    def close(self) -> None:
        """Release what OpenGL holds; may be called twice."""
        self._renderer.close()


def _plant(scene: mujoco.MjvScene, pole: Pole) -> None:
    geom = scene.geoms[scene.ngeom]
    size, place = np.array([0.03, 0.03, 0.6]), np.array([pole.x, 0.6, 0.6])
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


def _with_endless_floor(model: mujoco.MjModel) -> mujoco.MjModel:
    # Gymnasium's floors end after 40 m for the eye only; a robot runs further
    model = copy.copy(model)
    ends = (model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE) & (model.geom_size[:, 0] > 0)
    for plane in np.flatnonzero(ends):
        # an endless plane counts its texture's repeats per metre
        model.mat_texrepeat[model.geom_matid[plane]] /= 2 * model.geom_size[plane, :2]
        model.geom_size[plane, :2] = 0.0
    return model
