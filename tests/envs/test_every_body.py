"""Every shipped body does every family that it can: it is paid for the family's quantity, and nothing else."""

import numpy as np
import pytest

from rebody.bodies import load_robot, shipped_robots
from rebody.envs.shipped import PointMassEnv, RobotEnv
from rebody.tasks import SHIPPED
from rebody.tasks.line import LINE

TARGETS = {"goal": -3.0, "velocity": 1.5, "stand": 0.5, "jump": 1.0}
CAN_DO = [("point-mass", "goal"), ("point-mass", "velocity")] + [
    (robot, family) for robot in shipped_robots() for family, _ in load_robot(robot).reach if family in LINE.names
]


def test_all_families_of_the_line_have_a_body_that_does_them():
    """`jump` is asked of robots by a flag of their training (`--reach jump 0.5 3.0`)."""
    assert {family for _, family in CAN_DO} | {"jump"} == set(LINE.names) == TARGETS.keys()


@pytest.mark.parametrize(("body", "family"), [*CAN_DO, ("cheetah", "jump")])
def test_a_body_is_paid_for_the_quantity_of_its_family(body, family):
    families = SHIPPED.paid_by("plain")
    env = PointMassEnv(families=families) if body == "point-mass" else RobotEnv(body, families=families)
    (field,), target = SHIPPED.named(family).quantity.components, TARGETS[family]
    _, info = env.reset(seed=3, options={"family": family, "target": target})
    assert (info["family"], *info["target"]) == (family, target)
    env.action_space.seed(3)
    for _ in range(12):
        observation, reward, terminated, _, info = env.step(env.action_space.sample())
        assert np.isfinite(observation).all()
        assert not terminated
        missed = abs(info[field] - target)
        assert reward == pytest.approx(-missed, rel=1e-4, abs=1e-5)
    env.close()
