"""A replay buffer holds the newest rows, and only what was written is drawn."""

import numpy as np
import pytest

from rebody.training.replay import Replay

SIZE = 7


@pytest.fixture
def replay():
    replay = Replay.empty(SIZE, {"number": np.full(1, -1), "twice": np.full((1, 2), -1.0)})
    for rows in replay.rows.values():
        rows[:] = -1
    return replay


def rows(first, count):
    number = np.arange(first, first + count)
    return {"number": number, "twice": np.stack([2.0 * number, -number], axis=-1)}


@pytest.mark.parametrize("count", [1, 3, 7])
def test_the_newest_rows_replace_the_oldest(replay, count):
    """Rows of a turn may lie across the end."""
    for written in range(0, 30, count):
        replay.append(rows(written, count))
        newest = written + count
        expected = [max((n for n in range(newest) if n % SIZE == place), default=-1) for place in range(SIZE)]
        np.testing.assert_array_equal(replay.rows["number"], expected)
    np.testing.assert_array_equal(replay.rows["twice"][:, 0], 2.0 * replay.rows["number"])
    np.testing.assert_array_equal(replay.rows["twice"][:, 1], -1.0 * replay.rows["number"])


@pytest.mark.parametrize("written", [1, 3, 7, 8, 50])
def test_only_written_rows_are_drawn_and_each_of_them(replay, written):
    for number in range(written):
        replay.append(rows(number, 1))
    drawn = replay.draw((40, 10), np.random.default_rng(0))
    assert drawn["number"].shape == (40, 10)
    assert drawn["twice"].shape == (40, 10, 2)
    assert set(drawn["number"].ravel()) == set(range(max(0, written - SIZE), written))
    np.testing.assert_array_equal(drawn["twice"][..., 1], -1.0 * drawn["number"])


def test_a_seed_decides_what_is_drawn(replay):
    replay.append(rows(0, SIZE))
    one, same, other = (replay.draw((20,), np.random.default_rng(seed))["number"] for seed in (0, 0, 1))
    np.testing.assert_array_equal(one, same)
    assert (one != other).any()
