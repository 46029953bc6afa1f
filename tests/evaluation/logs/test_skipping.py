"""Damaged rows and gaps: errors that name the option, or left out, counted and not heard."""

import numpy as np
import pytest

from rebody.errors import RebodyError
from rebody.evaluation.logs import read_log, resample
from rebody.evaluation.logs.rows import _ascending

HEADER = "time_s,position_m,velocity_m_s,reward"
ROWS = [f"{0.05 * i:.2f},{0.1 * i:.2f},2,-1" for i in range(41)]


@pytest.fixture
def read(tmp_path):
    """A function: rows by number that are damaged -> log; every other row is whole."""

    def read(damaged=None, skip=True, rows=ROWS):
        path = tmp_path / "log.csv"
        lines = [(damaged or {}).get(i, row) for i, row in enumerate(rows)]
        path.write_text("\n".join([HEADER, *(line for line in lines if line is not None)]))
        return read_log(path, ("x", "vx"), skip_bad_rows=skip)

    return read


DAMAGES = {
    3: ("0.15,nan,2,-1", "1 not finite", "position_m is 'nan'"),
    5: ("0.25,0.5,-inf,-1", "1 not finite", "velocity_m_s is '-inf'"),
    7: ("0.35,0.7,2,", "1 unreadable", "reward is ''"),
    9: ("0.45,1_0,2,-1", "1 unreadable", "position_m is '1_0'"),
    11: ("later,1.1,2,-1", "1 unreadable", "time_s is 'later'"),
    13: ("0.65,1e9,2,-1", "1 too large", "position_m is '1e9', larger than any"),
    15: ("9e99,1.5,2,-1", "1 too large", "time_s is '9e99', larger than any"),
    17: ("0.85,1.7", "1 with a wrong number of cells", "2 cells where the first line names 4 columns"),
    19: ("0.95,1.9,2,-1,7", "1 with a wrong number of cells", "5 cells where the first line names 4 columns"),
    21: ("1.00,2.1,2,-1", "1 with a repeated time stamp", "time_s is 1 after 1; time must ascend"),
    23: ("0.02,2.3,2,-1", "1 with a time stamp out of order", "time_s is 0.02 after 1.1; time must ascend"),
    25: ("77,2.5,2,-1", "1 with a time stamp out of order", "time_s is 1.3 after 77; time must ascend"),
}


@pytest.mark.parametrize("row", DAMAGES)
def test_one_damaged_row(row, read):
    damaged, kind, says = DAMAGES[row]
    with pytest.raises(
        RebodyError, match=rf"line {row + 2 + (row == 25)}: {says}.*--skip-bad-rows leaves such rows out"
    ):
        read({row: damaged}, skip=False)
    log = read({row: damaged})
    assert log.notes == (f"skipped 1 of 41 rows: {kind}.",)
    np.testing.assert_allclose(log.fields["x"], np.delete(0.1 * np.arange(41), row), atol=1e-9)


def test_counted_by_kind(read):
    log = read({row: damaged for row, (damaged, *_) in DAMAGES.items()})
    (note,) = log.notes
    assert note == (
        "skipped 12 of 41 rows: 2 not finite, 3 unreadable, 2 too large, 2 with a wrong number of cells, "
        "1 with a repeated time stamp, 2 with a time stamp out of order."
    )
    np.testing.assert_allclose(resample(log, ("x", "vx")).fields["x"], 0.2 * np.arange(21), atol=1e-9)


def test_a_whole_log_is_read_as_without_the_option(read):
    log = read()
    assert log.notes == ()
    np.testing.assert_array_equal(log.time_s, read(skip=False).time_s)


def test_in_a_gap_nothing_is_heard(read):
    lost = dict.fromkeys(range(11, 27))  # from 0.5 to 1.35 s
    with pytest.raises(RebodyError, match=r"line 13: no sample for 0\.85 s.*--skip-bad-rows goes on after it"):
        read(lost, skip=False)
    log = read(lost)
    assert log.notes == ("1 gap of more than 0.3 s without a sample, 0.85 s in all: the belief hears nothing there.",)
    decisions = resample(log, ("x", "vx"))
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(decisions.reward)), range(5, 14))
    np.testing.assert_allclose(decisions.reward[[4, 14]], -1.0)


def test_the_decision_after_a_gap_begins_with_the_logged_velocity(read):
    """A robot that was carried away meanwhile did not run there."""
    rows = [*ROWS[:11], *(f"{0.05 * i:.2f},{50 + 0.1 * i:.2f},2,-1" for i in range(27, 41))]
    vx = resample(read(rows=rows), ("x", "vx")).fields["vx"]
    np.testing.assert_allclose(vx, 2.0, atol=1e-9)


def test_short_losses_are_bridged(read):
    decisions = resample(read(dict.fromkeys((12, 13, 14, 15, 16), "?,?,?,?")), ("x", "vx"))
    assert np.isfinite(decisions.reward).all()
    np.testing.assert_allclose(decisions.fields["x"], 0.2 * np.arange(21), atol=1e-9)


def test_a_time_stamp_far_ahead_at_the_end_is_named(read):
    with pytest.raises(RebodyError, match=r"line 42: no sample for 1e\+09 s.*at most 3600 s.*split the log"):
        read({40: "1e9,4,2,-1"})


def test_a_log_of_damaged_rows_alone(read):
    with pytest.raises(RebodyError, match=r"too short: 0 rows over 0 s \(skipped 41 of 41 rows: 41 not finite\)"):
        read(dict.fromkeys(range(41), "nan,nan,nan,nan"))


def test_the_most_rows_that_ascend():
    def kept(*time):
        return np.array(time)[_ascending(np.array(time, float))].tolist()

    assert kept(1, 2, 3) == [1, 2, 3]
    assert kept(1, 9, 2, 3) == [1, 2, 3]
    assert kept(1, 8, 9, 2, 3, 4) == [1, 2, 3, 4]
    assert kept(5, 0, 6, 7) in ([5, 6, 7], [0, 6, 7])
    np.testing.assert_array_equal(_ascending(np.array([1.0, 2, 2, 2, 3])), [True, True, False, False, True])
    np.testing.assert_array_equal(_ascending(np.array([3.0, 3, 3])), [True, False, False])


def test_as_many_as_a_slow_count_finds():
    rng = np.random.default_rng(0)
    for _ in range(50):
        time = rng.integers(0, 12, 15).astype(float)
        longest = [1] * len(time)
        for i in range(len(time)):
            longest[i] = 1 + max((longest[j] for j in range(i) if time[j] < time[i]), default=0)
        kept = time[_ascending(time)]
        assert (np.diff(kept) > 0).all()
        assert len(kept) == max(longest)
