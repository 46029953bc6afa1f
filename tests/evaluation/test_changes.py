"""What comes after a change of the task, on episodes of 3 s that change after 1 s, counted by hand."""

import numpy as np
import pytest

from rebody.evaluation.changes import summarise_changes

AFTER = 20
"""Decisions after the change."""


@pytest.fixture
def changed(result):
    """A function of (old task, new task, decisions until it is read, path) -> the result of one episode."""

    def make(old, new, read_after, x=None):
        def along(index, until):
            return [old[index]] * until + [new[index]] * (30 - until)

        return result(
            active_family=along(0, 10), active_target=along(1, 10),
            inferred_family=along(0, 10 + read_after - 1), inferred_target=along(1, 10 + read_after - 1),
            quantities={"x": x or [0.0] * 30, "vx": (10 * np.diff([0.0, *(x or [0.0] * 30)])).tolist()},
        )  # fmt: skip

    return make


def medians(*episodes):
    found = summarise_changes(episodes)
    return found["episodes"], found["noticed_s"]["value"], found["recovered_s"]["value"]


def test_a_change_is_noticed_when_family_and_sign_are_right(changed):
    episode = changed(("goal", 5.0), ("goal", -4.0), 3)
    np.testing.assert_array_equal(episode.base_task_right(), [True] * 10 + [False] * 2 + [True] * 18)
    assert medians(episode)[:2] == (1, pytest.approx(0.3))


def test_a_goal_is_recovered_when_the_body_is_near_it(changed):
    path = [5.0] * 14 + [-3.8] * 16
    assert medians(changed(("goal", 5.0), ("goal", -4.0), 3, path))[2] == pytest.approx(0.5)


def test_a_speed_is_recovered_when_its_mean_over_a_second_is_right(changed):
    path = [0.0] * 10 + [0.2 * (i + 1) for i in range(20)]  # 2 m/s from the change on; 1.75 m/s counts
    assert medians(changed(("goal", 5.0), ("velocity", 2.0), 1, path))[2] == pytest.approx(0.9)


def test_what_never_comes_to_pass_lasts_to_the_end(changed):
    assert medians(changed(("goal", 5.0), ("velocity", 2.0), AFTER + 1)) == (1, pytest.approx(2.0), pytest.approx(2.0))


def test_a_change_of_the_family_alone_begins_where_it_begins(changed):
    assert medians(changed(("goal", 2.0), ("velocity", 2.0), 4))[:2] == (1, pytest.approx(0.4))


def test_a_target_that_moves_within_its_base_task_is_no_change(changed, result):
    assert summarise_changes([result(), changed(("goal", 5.0), ("goal", 4.0), 1)]) is None
    both = changed(("goal", 5.0), ("goal", 4.0), 1), changed(("goal", 5.0), ("goal", -4.0), 7)
    assert medians(*both)[:2] == (1, pytest.approx(0.7))
