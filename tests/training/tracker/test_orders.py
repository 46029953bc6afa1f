"""Orders: points in the world that last for a while."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from rebody.control.tracker import MARGIN
from rebody.ranges import interval
from rebody.tasks import SHIPPED, FamilySet
from rebody.training.tracker.commands import ToyGuide
from rebody.training.tracker.orders import commands, follow_guides, no_orders, renew
from rebody.training.tracker.schedule import NARROWEST, schedule
from rebody.types import Task

GOAL, VELOCITY, STAND = range(3)  # slots


def move_to(batch, x):
    batch.place(x)


def give(orders, batch, config, seed):
    lasting = schedule(config, 0, batch.spec.control_dt)
    renew(orders, batch, config, lasting, np.random.default_rng(seed), jax.random.key(seed))


def copy(orders):
    return jax.tree.map(np.copy, orders)


@pytest.fixture
def ordered(batch, config):
    """(orders, drawn) of robots at x = 100: some that hold goals and speeds, and the commands then."""
    move_to(batch, 100.0)
    for seed in range(20):
        orders = no_orders(config.robots, config.families)
        give(orders, batch, config, seed)
        if len(set(orders.slot)) == 2:
            return orders, commands(orders, batch, config.families)
    raise AssertionError("no draw with both slots")


def test_orders_are_given_at_once_and_within_reach(ordered, config):
    orders, seen = ordered
    limits = MARGIN * np.where(seen.slot == GOAL, 5.0, 3.0)
    assert (np.abs(seen.value[:, 0]) <= limits).all()
    assert (orders.steps_left > 0).all()


def test_a_goal_stays_where_it_is_in_the_world(ordered, batch, config):
    orders, seen = ordered
    world = np.where(orders.slot == GOAL, 100.0, 0.0)[:, None] + seen.value
    np.testing.assert_allclose(orders.value, world, rtol=1e-6)
    move_to(batch, np.array([99.0, 101.5, 103.0]))
    later = commands(orders, batch, config.families)
    np.testing.assert_array_equal(later.slot, seen.slot)
    nearer = np.where(seen.slot == GOAL, np.array([-1.0, 1.5, 3.0]), 0.0)
    np.testing.assert_allclose(later.value, seen.value - nearer[:, None], atol=2e-5)


def test_an_order_lasts_until_its_time_is_up(ordered, batch, config):
    orders, _ = ordered
    orders.steps_left[:] = (3, 0, 50)
    before = copy(orders)
    given = []
    for step in range(4):
        give(orders, batch, config, 100 + step)
        given.append((orders.value != before.value)[:, 0])
        if step == 0:
            kept = orders.value[1]
    np.testing.assert_array_equal(np.array(given).T, [[0, 0, 0, 1], [1, 1, 1, 1], [0, 0, 0, 0]])
    assert orders.value[1] == kept
    assert orders.steps_left[2] == 46


def test_an_order_lasts_as_long_as_the_settings_say(batch, config):
    lasting = []
    for seed in range(200):
        orders = no_orders(config.robots, config.families)
        give(orders, batch, config, seed)
        lasting.extend(orders.steps_left * batch.spec.control_dt)
    shortest, longest = config.segment_s
    assert min(lasting) == pytest.approx(shortest, abs=0.2)
    assert max(lasting) == pytest.approx(longest, abs=0.2)
    assert np.mean(lasting) == pytest.approx((shortest + longest) / 2, abs=0.5)


def test_a_quarter_is_guided_to_something_farther(batch, config):
    guided, ratio = [], []
    for seed in range(300):
        orders = no_orders(config.robots, config.families)
        give(orders, batch, config, seed)
        guided.extend(orders.guided)
        assert ((orders.guide_horizon >= 1) & (orders.guide_horizon <= config.max_horizon)).all()
        value, target = orders.value[:, 0], orders.guide_target[:, 0]
        away = value != 0
        times = np.where(orders.slot == GOAL, 2.0, 1.0)
        ratio.extend((target / np.where(away, value, 1.0) / times)[away])
    assert np.mean(guided) == pytest.approx(0.25, abs=0.06)
    np.testing.assert_allclose(ratio, 1.0, rtol=1e-5)


def test_only_guided_robots_are_told_where_their_toy_will_be(ordered, batch, config):
    orders, _ = ordered
    orders.guided[:] = (True, False, True)
    orders.slot[:] = (GOAL, GOAL, VELOCITY)
    orders.guide_target[:, 0] = (107.0, 107.0, 2.0)
    orders.guide_horizon[:] = (5, 5, 2)
    before = copy(orders)
    state = batch.observe()
    follow_guides(orders, state, config)
    guide = ToyGuide(Task(orders.slot, orders.guide_target), orders.guide_horizon)
    toys = guide.subgoal(config.families, state, config.max_horizon)
    np.testing.assert_allclose(orders.value[[0, 2]], np.asarray(toys.value)[[0, 2]], rtol=1e-6)
    assert 100.0 < orders.value[0] < 102.0
    assert orders.value[1] == before.value[1]
    np.testing.assert_array_equal(orders.steps_left, before.steps_left)


@pytest.fixture
def standing(batch, config):
    """Settings of robots that are asked to stand, too, at the pitches of `batch`."""
    batch.qpos[:, batch.spec.root_addresses[2]] = (0.3, -0.8, 0.0)
    stand = SHIPPED.named("stand").within(interval(-1.0, 0.5))
    return replace(config, families=config.families.beside(FamilySet((stand,))), guided_share=1.0)


def test_a_wanted_pitch_stays_where_it_is_in_the_world(batch, standing):
    wanted = []
    for seed in range(40):
        orders = no_orders(standing.robots, standing.families)
        give(orders, batch, standing, seed)
        stands = orders.slot == STAND
        wanted.extend(orders.value[stands, 0])
        assert not orders.guided[stands].any()  # a point mass does not pitch
        assert orders.guided[~stands].all()
        turned = orders.value[:, 0] - np.array([0.3, -0.8, 0.0])
        seen = commands(orders, batch, standing.families).value[:, 0]
        np.testing.assert_allclose(seen[stands], turned[stands], atol=1e-5)
    assert -MARGIN * 1.0 <= min(wanted) < -0.8
    assert 0.4 < max(wanted) <= MARGIN * 0.5


def test_an_order_that_is_carried_out_makes_room_for_another(batch, config):
    """In the thesis' curriculum, when robots have learned to last."""
    lasting = replace(schedule(config, 0, batch.spec.control_dt), change_when_reached=1.0)
    orders = no_orders(config.robots, config.families)
    orders.slot[:], orders.steps_left[:] = (GOAL, GOAL, VELOCITY), 50
    orders.value[:, 0] = (batch.x[0] + 0.05, batch.x[1] + 0.5, batch.observe().vx[2] + 0.05)
    before = orders.value.copy()
    renew(orders, batch, config, lasting, np.random.default_rng(0), jax.random.key(0))
    np.testing.assert_array_equal((orders.value != before)[:, 0], [True, False, True])


def test_the_range_of_speeds_widens_and_stays_wide(config, batch):
    widening = replace(config, widening_iterations=100)
    shares = [schedule(widening, i, batch.spec.control_dt).speed_share for i in (0, 50, 100, 500)]
    assert shares == pytest.approx([NARROWEST, (1 + NARROWEST) / 2, 1.0, 1.0])
    assert schedule(config, 0, batch.spec.control_dt).speed_share == 1.0
