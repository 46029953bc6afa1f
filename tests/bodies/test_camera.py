"""The camera follows a body past the end of Gymnasium's floor, and needs no display."""

import os

import numpy as np
import pytest

from rebody.bodies import camera, load_robot
from rebody.errors import RebodyError


@pytest.fixture
def headless(monkeypatch):
    for name in ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(camera.sys, "platform", "linux")
    monkeypatch.setattr(camera.importlib, "reload", lambda module: module)


def test_robot_and_tiles_are_in_the_picture_however_far_it_ran():
    view = camera.Camera(load_robot("cheetah").model, width=64, height=48)
    for x in (0.0, 60.0):
        picture = view.picture(np.array([x, 0, 0, 0, 0, 0, 0, 0, 0]))
        red, _, blue = np.moveaxis(picture.astype(int), -1, 0)
        assert (red - blue > 40).mean() > 0.01  # the robot is the only thing of its colour
        assert picture[-12:].std() > 30  # dark and light tiles
    view.close()
    view.close()


@pytest.mark.parametrize(("has_egl", "backend"), [(True, "egl"), (False, "osmesa")])
def test_chooses_a_backend_without_a_display(headless, monkeypatch, has_egl, backend):
    monkeypatch.setattr(camera, "_loads", lambda library: has_egl)
    camera.choose_opengl()
    assert os.environ.pop("MUJOCO_GL") == backend


@pytest.mark.parametrize("name", ["DISPLAY", "WAYLAND_DISPLAY"])
def test_leaves_the_choice_alone_where_there_is_a_display(headless, monkeypatch, name):
    monkeypatch.setenv(name, ":0")
    camera.choose_opengl()
    assert "MUJOCO_GL" not in os.environ


@pytest.mark.parametrize("error", [AttributeError("no GLContext"), ImportError("EGL"), RuntimeError("no display")])
def test_opengl_that_is_off_or_missing_is_one_message(error, monkeypatch):
    def renderer(*_):
        raise error

    monkeypatch.setattr(camera.mujoco, "Renderer", renderer)
    with pytest.raises(RebodyError, match="Set MUJOCO_GL to egl or osmesa"):
        camera.Camera(load_robot("cheetah").model)


def test_osmesa_that_is_missing_is_one_message(headless, monkeypatch):
    def reload(_):
        raise AttributeError("'NoneType' object has no attribute 'glGetError'")

    monkeypatch.setattr(camera, "_loads", lambda library: False)
    monkeypatch.setattr(camera.importlib, "reload", reload)
    with pytest.raises(RebodyError, match="Set MUJOCO_GL to egl or osmesa"):
        camera.Camera(load_robot("cheetah").model)
    assert os.environ.pop("MUJOCO_GL") == "osmesa"
