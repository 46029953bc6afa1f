"""The picture of a belief, for every kind of module."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from PIL import Image

from rebody.agents.belief import Reading
from rebody.evaluation.logs import BeliefOverTime, Decisions
from rebody.ranges import Box
from rebody.report import plot_beliefs
from rebody.tasks import SHIPPED, Family, FamilySet, Quantity
from rebody.types import Belief

TIME = 25


def assert_drawn(path):
    with Image.open(path) as picture:
        assert picture.format == "PNG"
        assert (np.asarray(picture.convert("L")) < 128).mean() > 0.001  # there is something on it
    assert not plt.get_fignums()


def own(name, *components):
    """A family of vectors."""
    targets = (Box((-3.0,) * len(components), (3.0,) * len(components)),)
    return Family(name, Quantity(name, components, "m", name), targets, floor=0.5, tolerance=0.3)


KNOWN = SHIPPED.beside(FamilySet((own("spot", "x", "y"), own("lean", "x", "pitch"))))


def run_of(fields, names, latent=3, clusters=0):
    time, families = 0.1 * np.arange(TIME + 1), KNOWN.only(tuple(names))

    def reading(i):
        mean = np.sin(0.1 * i * np.arange(1, latent + 1))
        shares = {k: float(k == 0) for k in range(clusters)}
        believed = families[i * len(families) // TIME]
        base_tasks = {
            (family.name, direction): (family == believed) / len(family.direction_names)
            for family in families
            for direction in family.direction_names
        }
        target = tuple(2.0 + 0.1 * np.arange(believed.size))
        return Reading(believed.name, target, np.eye(len(target)), base_tasks, shares, Belief(mean, np.ones(latent)))

    decisions = Decisions(time, {field: np.sin(time) for field in fields}, -np.ones(TIME))
    return BeliefOverTime("tiny", families, decisions, [reading(i) for i in range(TIME)], believed=TIME)


@pytest.mark.parametrize(
    "run",
    [
        run_of(("x",), ["goal"], latent=1),
        run_of(("x", "vx"), ["goal", "velocity"], clusters=2),
        run_of(("x", "vx", "pitch"), ["goal", "velocity", "stand"], clusters=5),
        run_of(("x",), ["goal", "velocity"]),
        run_of(("x", "y"), ["spot", "goal"]),
        run_of(("x", "pitch"), ["lean"]),
        run_of(("pitch",), ["lean", "spot"]),
    ],
    ids=[
        "one family, one number",
        "two families",
        "three families",
        "a velocity that is not seen",
        "a plane",
        "a vector",
        "vectors that are not seen",
    ],
)
def test_drawn_whole(run, tmp_path):
    path = tmp_path / "new" / "belief.png"
    plot_beliefs(run, path)
    assert_drawn(path)
    assert list(path.parent.iterdir()) == [path]


def test_a_family_that_was_never_believed(tmp_path):
    run = run_of(("x", "vx"), ["goal", "velocity"])
    for i, reading in enumerate(run.readings):
        run.readings[i] = Reading("goal", (2.0,), np.eye(1), reading.base_tasks, {}, reading.latent)
    plot_beliefs(run, tmp_path / "belief.png")
    assert_drawn(tmp_path / "belief.png")
