"""A module of a user's own families, whose targets are vectors, on the page."""

from dataclasses import asdict, replace

import equinox as eqx
import numpy as np
import pytest

from rebody.agents.configs import InferenceSettings
from rebody.agents.parts import Inference, inference_template
from rebody.bodies.toys import MassDamper
from rebody.ranges import Box
from rebody.store.typed import typed
from rebody.tasks import Direction, Family, FamilySet, Quantity
from rebody.tasks.task_file import TaskSpec

viser = pytest.importorskip("viser")
pytest.importorskip("mjviser")
from rebody.viewer import words  # noqa: E402
from rebody.viewer.controls import Choice, Controls, Offered  # noqa: E402
from rebody.viewer.page import Page  # noqa: E402
from rebody.viewer.scene import ARROW_M, EDGE_M, _arrow  # noqa: E402
from rebody.viewer.server import serving  # noqa: E402
from rebody.viewer.session import Session  # noqa: E402

SIDES = (Direction("left", (0.0, 1.0)), Direction("right", (0.0, -1.0)))
PLACE = Family(
    "place", Quantity("place", ("x", "y"), "m", "place"), (Box((2.0, -4.0), (6.0, 4.0)),), 0.5, 0.3, directions=SIDES
)
SPEED = Family("speed", Quantity("speed", ("vx",), "m/s", "speed"), (Box((-0.04,), (0.04,)),), 0.5, 0.3)
TASK, OTHER = TaskSpec("place", (3.0, 1.5)), TaskSpec("speed", (0.04,))
CHOICE, OFFERED = Choice("point-mass", "own", "reuse"), Offered(["point-mass"], ["own"])


@pytest.fixture(scope="module")
def own_trial(trial, stored_config):
    """A point mass that hears of a plane, although it moves along a line."""
    contract = replace(trial.inference.contract, families=FamilySet((PLACE, SPEED)))
    settings = typed(stored_config | {"contract": asdict(contract)}, InferenceSettings)
    parts = eqx.filter_jit(lambda: inference_template(settings))()
    inference = Inference("own", settings.contract, parts, MassDamper())
    return replace(trial, inference=inference, robot=None, tracker=None, flat=None)


def test_a_session_tells_all_components(own_trial):
    session = Session(own_trial, TASK)
    session.step()
    moment = session.moments[-1]
    assert (moment.task, len(moment.reached["place"]), len(moment.reached["speed"])) == (TASK, 2, 1)
    assert set(moment.reading.base_tasks) == {("place", "left"), ("place", "right"), ("speed", "")}
    says = words.numbers(own_trial.in_play, TASK, moment)
    assert "place +3.00, +1.50 m" in says


def test_the_page_follows_from_vectors_to_numbers_and_back(own_trial):
    with serving(0) as server:
        page = Page(server, OFFERED, lambda _: own_trial, CHOICE, own_trial, TASK)
        page._watch(CHOICE, Session(own_trial, TASK))
        for task in (TASK, OTHER, TASK):
            page._carry_out(task)
            for _ in range(3):
                page.session.step()
            page._show(1.0)
            assert page.session.task == task


def test_a_slider_per_component(own_trial):
    with serving(0) as server:
        controls = Controls(server.gui, OFFERED, CHOICE)
        controls.show_task(own_trial, OTHER)
        assert [slider.label for slider in controls._targets if slider.visible] == ["Target [m/s]"]
        assert controls._chosen_task() == OTHER
        controls.show_task(own_trial, TASK)
        assert [slider.label for slider in controls._targets if slider.visible] == ["Target x [m]", "Target y [m]"]
        assert controls._targets[0].order < controls._targets[1].order < controls._give.order
        assert controls._chosen_task() == TASK
        controls._targets[1].value = -9.0
        assert controls._chosen_task() == TaskSpec("place", (3.0, -4.0))
        controls.show_task(own_trial, OTHER)
        assert [slider.visible for slider in controls._targets] == [True, False]
        for _ in range(20):
            task = controls._any_task()
            box = own_trial.contract.families.ranges[task.family]
            assert np.all(np.array(box.low) <= task.target)
            assert np.all(task.target <= np.array(box.high))


@pytest.mark.parametrize(
    ("asked", "start", "along"),
    [
        ({"x": 9.0, "y": 1.0}, (EDGE_M, 0, 0), (ARROW_M, 0, 0)),
        ({"x": 1.0, "y": -4.0}, (0, -EDGE_M, 0), (0, -ARROW_M, 0)),
        ({"vx": 2.0}, (0, 0, 0), (2 * ARROW_M, 0, 0)),
        ({"vx": 2.0, "vy": -1.0}, (0, 0, 0), (2 * ARROW_M, -ARROW_M, 0)),
        ({"vz": 2.0}, (0, 0, 0), (0, 0, 2 * ARROW_M)),
        ({"pitch": 0.5}, (0, 0, 0), (np.sin(0.5), 0, np.cos(0.5))),
        ({"yaw": np.pi / 2}, (0, 0, 0), (0, 1, 0)),
        ({"yaw_rate": 1.0}, (0, 0, 0), (0, 0, 0)),
    ],
)
def test_an_arrow_says_what_is_asked(asked, start, along):
    begins, goes_on = _arrow(asked, np.array([1.0, 1.0]))
    np.testing.assert_allclose(begins, start, atol=1e-9)
    np.testing.assert_allclose(goes_on, along, atol=1e-9)


def test_what_lines_mean_is_said_by_their_directions():
    legend = words.family_legend(FamilySet((PLACE, SPEED)))
    assert "(solid: right, dashed: left)" in legend
    assert words.guide(FamilySet((replace(PLACE, label="go <there>"),))).count("*place*: go &lt;there&gt;") == 1
