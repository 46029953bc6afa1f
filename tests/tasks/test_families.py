"""Rewards by hand, what families are refused, and directions."""

from dataclasses import replace

import numpy as np
import pytest
from tests.tasks.conftest import DRIFT, LEAN, PLACE

from rebody.errors import RebodyError
from rebody.ranges import Box, interval
from rebody.tasks import LAWS, SHIPPED, Direction, FamilySet, RewardLaw
from rebody.tasks.laws import add_law, law_named
from rebody.tasks.line import GOAL, JUMP, LINE, STAND, VELOCITY
from rebody.types import GLOBAL_FIELDS, GlobalState, Task, global_state


def paid(family, target, **fields):
    """The reward of one target, of a set that holds the family alone."""
    families = FamilySet((family,))
    state = global_state(**{name: np.asarray(value, float) for name, value in fields.items()})
    return float(families.reward(families.task(family.name, target), state))


def plain(family):
    return replace(family, law="plain")


def relative(family):
    return replace(family, law="relative")


@pytest.mark.parametrize(
    ("family", "target", "state", "plainly", "relatively"),
    [
        (GOAL, 4.0, {"x": 1.0, "vx": 9.0}, -3.0, -0.75),
        (GOAL, -4.0, {"x": 1.0}, -5.0, -1.25),
        (GOAL, 0.5, {"x": 0.0}, -0.5, -0.5),  # divided by the floor of 1 m
        (GOAL, 0.0, {"x": 2.0}, -2.0, -2.0),
        (VELOCITY, 2.0, {"x": 9.0, "vx": 1.5}, -0.5, -0.25),
        (VELOCITY, -2.0, {"vx": 1.0}, -3.0, -1.5),
        (VELOCITY, 0.2, {"vx": 0.1}, -0.1, -0.2),  # divided by the floor of 0.5 m/s
        (STAND, 1.5, {"x": 9.0, "vx": 9.0, "pitch": 0.5}, -1.0, -2 / 3),
        (STAND, -0.5, {"pitch": 1.0}, -1.5, -3.0),
        (STAND, 0.1, {"pitch": 0.4}, -0.3, -1.0),  # divided by the floor of 0.3 rad
        (STAND, 3.1, {"pitch": -3.1}, 6.2 - 2 * np.pi, (6.2 - 2 * np.pi) / 3.1),  # the shorter way round
        (PLACE, (3.0, -4.0), {"x": 0.0, "vx": 9.0}, -5.0, -1.0),  # Euclidean, by the length of the target
        (PLACE, (0.0, 0.5), {"x": 3.0, "y": -3.5}, -5.0, -5.0),  # divided by the floor of 1 m
        (LEAN, (1.0, 3.0), {"x": 2.5, "yaw": 5.0 - 2 * np.pi}, -2.5, -2.5 / 10**0.5),
        (LEAN, (0.0, 3.1), {"x": 0.0, "yaw": -3.1}, 6.2 - 2 * np.pi, (6.2 - 2 * np.pi) / 3.1),
        (DRIFT, (2.0, 0.0), {"vy": 2.0, "yaw": np.pi / 2}, 0.0, 0.0),  # north is ahead of one that faces north
        (DRIFT, (0.0, -1.0), {"vx": 1.0, "yaw": np.pi / 2}, 0.0, 0.0),  # and east to its right
    ],
)
def test_reward_by_hand(family, target, state, plainly, relatively):
    state = dict.fromkeys(("x", "vx"), 0.0) | state
    assert paid(plain(family), target, **state) == pytest.approx(plainly, abs=2e-6)
    assert paid(relative(family), target, **state) == pytest.approx(relatively, abs=2e-6)


def test_a_batch_holds_different_families():
    families, two = FamilySet(tuple(map(plain, LINE))), np.full(3, 2.0)
    state = global_state(x=two, pitch=two / 2)
    np.testing.assert_allclose(families.reward(Task(np.arange(3), two[:, None]), state), [0.0, -2.0, -1.0])


def test_a_batch_holds_different_laws_and_sizes():
    families = FamilySet((plain(PLACE), relative(GOAL), plain(STAND)))
    state = global_state(x=np.zeros(3), y=np.full(3, 4.0), pitch=np.full(3, 1.0))
    targets = np.array([[3.0, 8.0], [5.0, 0.0], [-0.5, 0.0]])
    np.testing.assert_allclose(families.reward(Task(np.arange(3), targets), state), [-5.0, -1.0, -1.5], rtol=1e-6)


def test_what_is_achieved_is_padded(mixed):
    state = GlobalState(**{name: np.full(5, i, float) for i, name in enumerate(GLOBAL_FIELDS)})
    found = mixed.achieved(np.arange(5), state)
    cos, sin = np.cos(5.0), np.sin(5.0)  # of a yaw of 5 rad; vx is 6, vy is 7
    expected = [[0, 0], [0, 1], [6, 0], [0, 5], [6 * cos + 7 * sin, 7 * cos - 6 * sin]]
    np.testing.assert_allclose(found, expected, rtol=1e-5)


def test_a_jump_is_the_fastest_rise_on_the_way_all_else_the_last_state():
    series = np.array([[1.0, 5.0], [3.0, 9.0], [2.0, 7.0]], np.float32)  # [time, body]
    states = GlobalState(**dict.fromkeys(GLOBAL_FIELDS, series))
    asked = np.array([LINE.index("goal"), LINE.index("jump")])
    np.testing.assert_array_equal(LINE.achieved_by_way_of(asked, states), [[2.0], [9.0]])


def test_front_and_back_of_each_family_are_base_tasks():
    families, signs = np.repeat([0, 1, 2], 2), np.tile([-1.0, 1.0], 3)
    for size in (0.01, 3.0):
        np.testing.assert_array_equal(LINE.base_task(Task(families, size * signs[:, None])), [0, 1, 2, 3, 4, 5])
    assert LINE.base_tasks == 8


def test_base_tasks_of_families_that_have_many_directions_or_none(mixed):
    """Two of goals, four of places, two of speeds, one each of the last two."""
    targets = [[-1, 0], [1, 0], [5, 1], [1, 5], [-5, 1], [1, -5], [-1, 0], [1, 0], [-9, 2], [0, 0]]
    family = np.array([0, 0, 1, 1, 1, 1, 2, 2, 3, 4])
    np.testing.assert_array_equal(mixed.base_task(Task(family, np.array(targets, float))), np.arange(10))
    assert mixed.base_tasks == 10


def test_a_direction_is_the_nearest_one():
    rng = np.random.default_rng(0)
    angle, radius = rng.uniform(-np.pi, np.pi, 200), rng.uniform(0.1, 9.0, 200)
    target = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    sector = np.round(angle / (np.pi / 2)).astype(int) % 4
    np.testing.assert_array_equal(PLACE.direction(target), sector)
    assert int(PLACE.direction((0.0, -2.0))) == 3
    assert not LEAN.direction(target).any()
    assert LEAN.direction_names == ("",)


def test_a_heading_is_near_a_direction_either_way_round():
    turned = replace(LEAN, directions=(Direction("away", (0.0, 3.1)), Direction("ahead", (0.0, 0.0))))
    np.testing.assert_array_equal(turned.direction([[0.0, -3.1], [0.0, 1.0], [0.0, 2.0]]), [0, 1, 0])


def test_a_direction_is_as_sure_as_the_belief():
    """Of one number by the normal distribution, of two by its sectors."""
    back, front = GOAL.direction_chances(np.array([0.5]), np.array([1.0]))
    assert (back, front) == (pytest.approx(0.3085, abs=2e-3), pytest.approx(0.6915, abs=2e-3))
    np.testing.assert_allclose(PLACE.direction_chances(np.zeros(2), np.ones(2)), 0.25, atol=0.02)
    np.testing.assert_array_equal(PLACE.direction_chances(np.array([0.0, 5.0]), np.full(2, 0.1)), [0, 1, 0, 0])
    np.testing.assert_array_equal(LEAN.direction_chances(np.zeros(2), np.ones(2)), [1])


def test_a_target_is_a_vector_of_the_familys_size():
    assert GOAL.admit(3) == GOAL.admit([3.0]) == GOAL.admit((3.0,)) == (3.0,)
    assert PLACE.admit([3, -4]) == (3.0, -4.0)
    with pytest.raises(RebodyError, match=r"a target of 'place' has 2 numbers \(x, y\), not 1"):
        PLACE.admit(3.0)
    with pytest.raises(RebodyError, match=r"a target of 'goal' has 1 numbers \(x\), not 2"):
        GOAL.admit([1.0, 2.0])


def test_ranges_hold_all_base_tasks():
    assert GOAL.range == interval(-15.0, 15.0)
    assert JUMP.range == interval(1.5, 3.0)
    assert LEAN.range == Box((-4.0, -3.0), (4.0, 3.0))
    assert LEAN.range.largest == (4.0, 3.0)


def test_poses_are_places_and_attitudes():
    assert [family.is_pose for family in (GOAL, VELOCITY, STAND, JUMP, PLACE, LEAN, DRIFT)] == [
        True, False, True, False, True, True, False,
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"quantity": replace(GOAL.quantity, components=())}, "quantity.components: there must be at least one"),
        ({"quantity": replace(GOAL.quantity, components=("x", "x"))}, "none twice"),
        ({"quantity": replace(GOAL.quantity, components=("colour",))}, "'colour' is unknown; a global state has x, y"),
        ({"targets": ()}, "'x' has 1 numbers, so must their ends"),
        ({"targets": (Box((1.0, 1.0), (2.0, 2.0)),)}, "'x' has 1 numbers"),
        ({"targets": (interval(0.0, 0.0),)}, "there must be one that is not 0"),
        ({"directions": (Direction("up", (0.0, 1.0)),)}, "each must point to 1 numbers"),
        ({"law": "absolute"}, "'absolute' is not known as it was; name the file"),
        ({"law_source": "ab12"}, "'relative' is not known as it was; name the file"),
    ],
)
def test_what_cannot_be_asked_is_refused(change, says):
    with pytest.raises(ValueError, match=says):
        replace(GOAL, **change)


@pytest.mark.parametrize(("box", "law"), [(Box((1.0, 1.0), (2.0, 2.0)), None), (interval(1.0, 2.0), "absolute")])
def test_other_ranges_and_laws_are_checked_too(box, law):
    with pytest.raises(RebodyError, match="family 'goal': "):
        GOAL.within(box, law=law)
    assert GOAL.within(interval(1.0, 2.0), law="plain") == replace(GOAL, targets=(interval(1.0, 2.0),), law="plain")
    assert GOAL.within(interval(1.0, 2.0)).law == "relative"


@pytest.fixture
def own_law(monkeypatch):
    """A law of a user's own, known while a test lasts."""
    monkeypatch.setattr("rebody.tasks.laws.LAWS", LAWS)
    law = RewardLaw("squared", "-error^2", lambda distance, scale: -(distance**2), "ab12")
    add_law(law)
    yield law
    del LAWS["squared"]


def test_a_law_of_ones_own_pays(own_law):
    assert law_named("squared") is own_law
    assert paid(replace(GOAL, law="squared"), 4.0, x=1.0) == pytest.approx(-9.0)
    assert paid(replace(PLACE, law="squared", law_source="ab12"), (3.0, 4.0), x=0.0) == pytest.approx(-25.0)


def test_a_law_that_is_known_is_not_replaced(own_law):
    add_law(own_law)  # the same file once more
    for other in (replace(own_law, source="cd34"), replace(own_law, name="plain")):
        with pytest.raises(RebodyError, match=f"a reward law '{other.name}' is known already"):
            add_law(other)
    with pytest.raises(ValueError, match="not known as it was"):
        replace(GOAL, law="squared", law_source="cd34")


def test_a_law_that_there_is_not():
    with pytest.raises(RebodyError, match=r"unknown law 'relativ'\. Did you mean 'relative'\? Laws are: plain, relat"):
        law_named("relativ")


# families together


def test_indices_are_those_of_the_order(mixed):
    assert mixed.names == ("goal", "place", "velocity", "lean", "drift")
    assert [mixed.index(name) for name in mixed.names] == [0, 1, 2, 3, 4]
    assert [mixed[i] for i in range(5)] == list(mixed) == [mixed.named(name) for name in mixed.names]
    other = mixed.only(("lean", "goal"))
    assert (other.index("goal"), mixed.index("goal")) == (1, 0)
    assert ("goal" in other, "place" in other) == (True, False)
    assert (mixed.size, LINE.size, len(mixed)) == (2, 1, 5)
    assert SHIPPED.names[:4] == LINE.names == ("goal", "velocity", "stand", "jump")


def test_others_come_behind_and_do_not_replace(mixed):
    nearer = FamilySet((GOAL.within(interval(-1.0, 1.0)), STAND))
    both = nearer.beside(mixed)
    assert both.names == ("goal", "stand", "place", "velocity", "lean", "drift")
    assert both.named("goal").range == interval(-1.0, 1.0)
    assert both.ranges["place"] == PLACE.range
    assert nearer.beside(nearer) == nearer


@pytest.mark.parametrize("families", [(), (GOAL, GOAL), (GOAL, GOAL.within(interval(1.0, 2.0)))])
def test_names_are_unique(families):
    with pytest.raises(ValueError, match="there must be at least one, and none twice"):
        FamilySet(families)


def test_a_name_that_there_is_not(mixed):
    for ask in (mixed.index, mixed.named, lambda name: mixed.only(("goal", name)), lambda name: mixed.task(name, 1.0)):
        with pytest.raises(RebodyError, match=r"'velocty'\. Did you mean 'velocity'\? Families are: .*goal"):
            ask("velocty")


def test_targets_are_padded_and_of_the_right_size(mixed):
    task = mixed.task("goal", -3.0)
    np.testing.assert_array_equal(task.target, [-3.0, 0.0])
    assert int(task.family) == 0
    np.testing.assert_array_equal(mixed.task("place", (1.0, 2.0)).target, [1.0, 2.0])
    np.testing.assert_array_equal(mixed.pad(np.ones((3, 1))), [[1.0, 0.0]] * 3)
    with pytest.raises(RebodyError, match="has 2 numbers"):
        mixed.task("place", (1.0, 2.0, 3.0))
    with pytest.raises(RebodyError, match="has 1 numbers"):
        mixed.task("goal", (1.0, 2.0))


def test_equal_sets_are_one_to_a_compiler(mixed):
    again = FamilySet(tuple(replace(family) for family in mixed))
    assert (again, hash(again)) == (mixed, hash(mixed))
    assert again != mixed.only(tuple(reversed(mixed.names)))
