"""The map of the plane, of a cart of our own that walks by a policy."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from tests.walking import write_cart

from rebody.cli.trial import TrialOptions
from rebody.tasks.task_file import TaskSpec

pytest.importorskip("onnxruntime")
pytest.importorskip("onnx")
pytest.importorskip("viser")
pytest.importorskip("mjviser")
from rebody.viewer import words
from rebody.viewer.controls import Choice, Controls, Offered, Push
from rebody.viewer.map import PX, Frame, draw_map
from rebody.viewer.page import Page
from rebody.viewer.server import serving
from rebody.viewer.session import Session, fitting

PLACE, RUN, TURN = TaskSpec("place", (3.0, -2.0)), TaskSpec("velocity_xy", (0.0, 0.6)), TaskSpec("heading", (2.0,))


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    return str(write_cart(tmp_path_factory.mktemp("cart")))


@pytest.fixture(scope="module")
def trial(robot):
    return TrialOptions(robot=robot, inference="plane").load()


@pytest.fixture(scope="module")
def session(trial):
    return Session(trial, PLACE)


def shapes(session) -> list[ElementTree.Element]:
    drawn = draw_map(session)
    assert "nan" not in drawn
    return list(ElementTree.fromstring(drawn))


def decide(session, decisions):
    for _ in range(decisions * session.body.steps_per_decision):
        session.step()


def test_a_place_is_marked_and_what_is_open_of_it_is_an_ellipse(session):
    session.set_task(PLACE)
    session.restart()
    assert not [each for each in shapes(session) if each.tag == "ellipse"]  # nothing is believed
    decide(session, 30)
    drawn = shapes(session)
    (path,) = [each for each in drawn if each.tag == "polyline"]
    assert len(path.attrib["points"].split()) == 32  # the start, 30 decisions, now
    assert len([each for each in drawn if each.tag == "ellipse"]) == 1
    marks = {title.text for each in drawn for title in each}
    assert marks == {"hidden", "believed", "subgoal"}


@pytest.mark.parametrize("task", [RUN, TURN])
def test_velocities_and_headings_are_arrows_on_the_map(session, task):
    session.set_task(task)
    session.restart()
    decide(session, 15)
    drawn = shapes(session)
    arrows = [each for each in drawn if each.tag == "path" and "L" in each.attrib["d"]]
    assert len(arrows) == 4  # hidden, believed, subgoal, and where the robot heads
    ends = [float(number) for arrow in arrows for number in re.findall(r"-?\d+\.\d", arrow.attrib["d"])]
    assert min(ends) > 0
    assert max(ends) < PX


def test_up_on_the_map_is_left_of_where_x_points():
    frame = Frame((1.0, 2.0), 10.0)
    assert frame.px((1.0, 2.0)) == (PX / 2, PX / 2)
    assert frame.px((6.0, 7.0)) == (PX, 0.0)


def test_a_cart_is_pushed_along_both_axes(session):
    session.set_task(PLACE)
    for axis in (0, 1):
        session.restart()
        before = session.body.qvel[0, :2].copy()
        session.push(0.5, axis)
        np.testing.assert_allclose(session.body.qvel[0, :2] - before, 0.5 * np.eye(2)[axis])


def test_controls_have_a_slider_for_each_number_and_pushes_for_each_axis(trial, robot):
    with serving(0) as server:
        controls = Controls(server.gui, Offered([robot], ["plane"]), Choice(robot, "plane", "reuse"))
        controls.show_task(trial, PLACE)
        assert [slider.label for slider in controls._targets if slider.visible] == ["Target x [m]", "Target y [m]"]
        assert controls._pushes[1].visible
        controls._pushes[1].value = "+1"
        rings = {"place": (2.0, 15.0), "velocity_xy": (0.3, 2.0)}
        for _ in range(30):
            task = controls._any_task()
            low, high = rings.get(task.family, (0.0, np.pi))
            assert low - 0.1 <= np.linalg.norm(task.target) <= high + 0.1
    assert Push(1.0, 1).axis == 1


def test_the_page_shows_a_cart_and_goes_on_to_a_robot_of_the_line(trial, robot):
    """`plane` does not know the cheetah: a module that does is chosen with it, and back."""
    offered = Offered([robot, "cheetah"], ["plane", "goal-velocity"])

    def load(choice):
        return TrialOptions(robot=choice.robot, inference=choice.inference, agent=choice.agent).load()

    choice = Choice(robot, "plane", "reuse")
    with serving(0) as server:
        page = Page(server, offered, load, choice, trial, PLACE)
        page._watch(choice, Session(trial, PLACE))
        for task in (PLACE, RUN, TURN):
            page._carry_out(task)
            decide(page.session, 2)
            page._show(1.0)
        assert "<svg" in page._panel._map.content
        page._carry_out(replace(choice, robot="cheetah"))
        assert page._choice == Choice("cheetah", "goal-velocity", "reuse")
        page._show(2.0)
        assert page._panel._map.content == ""
        page._carry_out(replace(page._choice, robot=robot))
        assert page._choice == choice


def test_a_first_task_is_one_that_the_module_knows(trial):
    assert fitting(trial, TaskSpec("goal", (4.0,))) == TaskSpec("place", (4.5, 4.5))
    assert "*place*: reach a place" in words.guide(trial.inference.contract.families)
