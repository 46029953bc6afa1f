"""Settings of each kind of robot."""

from dataclasses import replace

import pytest

from rebody.bodies import load_robot, shipped_robots
from rebody.training.tracker import tracker_preset

LINE = [name for name in shipped_robots() if load_robot(name).walking is None]


@pytest.mark.parametrize("name", LINE)
def test_a_robot_is_trained_for_its_own_reach(name):
    spec = load_robot(name)
    assert tuple(tracker_preset(spec).families.ranges.items()) == spec.reach


def test_a_slot_more_takes_longer():
    cheetah = load_robot("cheetah")
    two_slots = replace(cheetah, reach=tuple(each for each in cheetah.reach if each[0] != "stand"))
    assert tracker_preset(cheetah).iterations > tracker_preset(two_slots).iterations


def test_only_a_balancing_robot_that_is_to_run_is_told_to_go_slowly_first():
    widening = {name: tracker_preset(load_robot(name)).widening_iterations for name in LINE}
    assert [name for name in widening if widening[name]] == ["walker"]


@pytest.mark.parametrize("name", LINE)
def test_the_last_updates_are_taken_at_the_lowest_learning_rate(name):
    config = tracker_preset(load_robot(name))
    assert config.sac.decay_updates == pytest.approx(config.iterations * config.updates, rel=0.01)


def test_only_what_has_to_balance_is_paid_for_staying_alive():
    alive = {name: tracker_preset(load_robot(name)).reward.alive for name in LINE}
    relative = {name: tracker_preset(load_robot(name)).reward.relative for name in LINE}
    assert [name for name in alive if alive[name]] == [name for name in relative if relative[name]]
    assert [name for name in alive if alive[name]] == ["hopper", "walker"]
