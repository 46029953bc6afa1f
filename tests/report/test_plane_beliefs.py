"""Pictures of beliefs in the plane show what they are given."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.patches import Ellipse

from rebody.agents.belief import Reading
from rebody.report.plane_beliefs import BELIEVED_R, EDGE_M, draw_against, draw_headings, draw_path, draw_sharpening
from rebody.types import Belief


@pytest.fixture
def axes():
    drawing, axes = plt.subplots()
    yield axes
    plt.close(drawing)


def drawn(axes, label):
    (line,) = [each for each in axes.lines if each.get_label() == label]
    return line.get_xydata()


def test_a_place_that_is_believed_beyond_the_frame_lies_at_its_edge(axes):
    true, believed = np.array([1.0, -2.0, 3.0]), np.array([1.5, -70.0, 4.0])
    draw_against(axes, true, believed, np.array([True, True, False]))
    np.testing.assert_allclose(drawn(axes, "its family is the likeliest"), [[1.0, 1.5], [-2.0, -EDGE_M]])
    np.testing.assert_allclose(drawn(axes, "another family is likelier"), [[3.0, 4.0]])
    assert axes.get_xlim()[0] < -EDGE_M < EDGE_M < axes.get_xlim()[1]


def test_headings_that_are_right_lie_on_one_ray(axes):
    angles = np.array([0.3, 2.0, -3.0])
    draw_headings(axes, angles, angles + np.array([0.0, 0.0, 2 * np.pi]), np.ones(3, bool))
    np.testing.assert_allclose(drawn(axes, "believed"), BELIEVED_R * drawn(axes, "true"), atol=1e-12)


def test_a_belief_that_is_sharpened_goes_from_the_guess_step_by_step(axes):
    line = np.linspace(-2.0, 2.0, 5)
    places = np.stack(np.meshgrid(line, line), axis=-1)
    target = np.array([1.0, -1.0])
    nats = 0.5 * np.sum((places - target) ** 2, axis=-1)
    steps = np.array([[0.0, 0.0], [0.5, -0.5], [1.0, -1.0]])
    image = draw_sharpening(axes, places, nats, np.zeros((2, 2)), steps, -target, target)
    np.testing.assert_allclose(np.asarray(image.get_array()), np.linalg.norm(places - target, axis=-1), atol=1e-7)
    assert list(image.get_extent()) == [-2.0, 2.0, -2.0, 2.0]
    assert image.origin == "lower"  # rows are y, from below
    np.testing.assert_allclose(drawn(axes, "Gauss-Newton steps"), steps)
    np.testing.assert_allclose(drawn(axes, "encoder's guess"), steps[:1])


def reading(family, target, std):
    return Reading(family, target, std**2 * np.eye(2), {}, {}, Belief(np.zeros(2), np.ones(2)))


def test_a_path_has_what_was_believed_when_the_body_was_there(axes):
    path = np.stack([np.linspace(0.1, 4.0, 12), np.zeros(12)], axis=-1)
    readings = [reading("place", (4.0, 1.0), 0.5)] * 9 + [reading("velocity_xy", (0.3, 0.1), 0.1)] * 3
    draw_path(axes, path, readings, np.array([4.0, 0.0]), "place")
    np.testing.assert_allclose(drawn(axes, "0.5 s"), path[4:5])
    np.testing.assert_allclose(drawn(axes, "1 s"), path[9:10])
    (ellipse,) = [each for each in axes.patches if isinstance(each, Ellipse)]
    assert ellipse.center == (4.0, 1.0)
    assert ellipse.width == pytest.approx(4 * 0.5)
