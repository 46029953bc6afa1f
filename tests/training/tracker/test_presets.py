"""Settings of each kind of robot."""

import pytest

from rebody.bodies import load_robot, shipped_robots
from rebody.training.tracker import tracker_preset


@pytest.mark.parametrize("name", shipped_robots())
def test_a_robot_is_trained_for_its_own_reach(name):
    spec = load_robot(name)
    assert tracker_preset(spec).reach == spec.reach


def test_a_slot_more_takes_longer():
    longest = max(shipped_robots(), key=lambda name: tracker_preset(load_robot(name)).iterations)
    assert load_robot(longest).reach.pitch is not None


def test_only_what_has_to_balance_is_paid_for_staying_alive():
    alive = {name: tracker_preset(load_robot(name)).reward.alive for name in shipped_robots()}
    relative = {name: tracker_preset(load_robot(name)).reward.relative for name in shipped_robots()}
    assert [name for name in alive if alive[name]] == [name for name in relative if relative[name]]
    assert [name for name in alive if alive[name]] == ["hopper", "walker"]
