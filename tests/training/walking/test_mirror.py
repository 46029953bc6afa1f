"""In a mirror the physics is the same."""

from dataclasses import replace

import numpy as np
import pytest
from tests.walking import robot_that_is_there

from rebody.bodies import load_robot
from rebody.bodies.walking.batch import JointBatch
from rebody.errors import RebodyError
from rebody.training.walking.mirror import mirror_of


@pytest.fixture
def quadruped():
    return replace(load_robot("quadruped"), reset_noise=0.0)


def test_a_quadruped_in_a_mirror_moves_as_the_mirror_shows(quadruped):
    batch, rng = JointBatch(quadruped, 2, threads=1), np.random.default_rng(0)
    mirror = mirror_of(batch.joints, quadruped.walking.mirror, "quadruped")
    batch.reset(rng)
    batch.push(np.array([[0.3, 0.4], [0.3, -0.4]]))
    command = np.array([[0.5, 0.2, -0.3], [0.5, -0.2, 0.3]])
    for _ in range(25):
        action = rng.uniform(-1, 1, 12).astype(np.float32)
        batch.step(np.stack([action, mirror.done(action)]))
    one, other = batch.hear(command)
    np.testing.assert_allclose(mirror.seen(one), other, atol=2e-3)
    assert np.abs(one - other).max() > 0.1
    np.testing.assert_array_equal(mirror.seen(mirror.seen(one)), one)
    np.testing.assert_array_equal(mirror.ways(command[0]), command[1].astype(np.float32))


@pytest.mark.parametrize("name", ["ant", "berkeley", "go1"])
def test_others_do_so_in_the_air(name):
    """On the ground a solver that stops after a few iterations need not be alike on both sides."""
    spec = robot_that_is_there(name)
    batch, rng = JointBatch(replace(spec, reset_noise=0.0), 2, threads=1), np.random.default_rng(0)
    mirror = mirror_of(batch.joints, spec.walking.mirror, name)
    batch.reset(rng)
    batch.qpos[:, 2] += 1.0
    for _ in range(round(0.3 / batch.step_s)):
        action = rng.uniform(-0.5, 0.5, batch.actions).astype(np.float32)
        batch.step(np.stack([action, mirror.done(action)]))
    one, other = batch.hear(np.zeros((2, 3)))
    scale = np.abs(one - other).max()
    assert scale > 0.5
    np.testing.assert_allclose(mirror.seen(one), other, atol=0.05 * scale)  # legs weigh not quite the same


def test_a_robot_may_have_no_mirror(quadruped):
    assert mirror_of(JointBatch(quadruped, 1).joints, (), "quadruped") is None


def test_a_mirror_names_every_joint(quadruped):
    named = (*quadruped.walking.mirror[:-1], "RR_knee")
    with pytest.raises(RebodyError, match=r"'quadruped': .policy. mirror must name each of its joints once"):
        mirror_of(JointBatch(quadruped, 1).joints, named, "quadruped")
