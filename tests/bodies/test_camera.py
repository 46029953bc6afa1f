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


# models without a camera called `track`

COLOURED = ('type="box" size="0.3 0.1 0.1"', 'type="box" size="0.3 0.1 0.1" rgba="1 0.2 0.2 1"')
BOX_FLOOR = ('type="plane" size="9 9 1"', 'type="box" size="99 99 1" pos="0 0 -1"')
LIT_FLOOR = [
    ('type="plane"', 'type="plane" material="grid"'),
    ("<worldbody>", '<asset><material name="grid"/></asset><worldbody><light pos="0 0 3"/>'),
]
STANDING = ("<worldbody>", '<worldbody><camera name="track" pos="0 -3 1" xyaxes="1 0 0 0 0.3 1"/>')
SMALL_BUFFER = ("<worldbody>", '<visual><global offwidth="32" offheight="32"/></visual><worldbody>')


@pytest.mark.parametrize("mjcf", [[], [BOX_FLOOR], LIT_FLOOR, [STANDING], [SMALL_BUFFER]])
def test_the_picture_follows_the_root_of_a_model_without_a_camera(mjcf, write_own):
    spec = load_robot(write_own(mjcf=[COLOURED, *mjcf]))
    view = camera.Camera(spec.model, 64, 48, spec.root_body)
    for x in (0.0, 20.0):
        red, _, blue = np.moveaxis(view.picture(spec.rest_qpos + np.array([x, 0, 0, 0])).astype(int), -1, 0)
        rows, columns = np.nonzero(red - blue > 40)
        assert 0.01 < len(rows) / red.size < 0.3
        assert abs(columns.mean() - 32) < 4
        assert abs(rows.mean() - 24) < 6
    view.close()


def test_drawing_leaves_the_model_as_it_is(write_own):
    model = load_robot(write_own()).model
    before = model.stat.extent, model.vis.headlight.ambient.tolist(), model.geom_size.tolist()
    camera.Camera(model, 64, 48).close()
    assert (model.stat.extent, model.vis.headlight.ambient.tolist(), model.geom_size.tolist()) == before
