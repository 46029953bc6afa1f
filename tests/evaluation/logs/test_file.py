"""Logs are read as they are, or refused with what is wrong and where."""

import os

import numpy as np
import pytest

from rebody.errors import RebodyError
from rebody.evaluation.logs import COLUMNS, Format, read_log
from rebody.types import GLOBAL_FIELDS

GOOD = "time_s,position_m,velocity_m_s,reward\n0,0,0,0\n0.1,0.1,1,-1\n0.2,0.2,1,-0.9\n0.3,0.3,1,-0.8\n"


@pytest.fixture
def read(tmp_path):
    def read(content, fields=("x", "vx"), form=None):
        path = tmp_path / "log.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_log(path, fields, form)

    return read


def test_columns_that_the_module_needs(read):
    log = read(GOOD)
    np.testing.assert_array_equal(log.time_s, [0, 0.1, 0.2, 0.3])
    np.testing.assert_array_equal(log.fields["x"], [0, 0.1, 0.2, 0.3])
    np.testing.assert_array_equal(log.fields["vx"], [0, 1, 1, 1])
    np.testing.assert_array_equal(log.reward, [0, -1, -0.9, -0.8])
    assert log.ignored == ()


def test_others_are_ignored_whatever_they_hold(read):
    rows = GOOD.splitlines()
    wider = "\n".join([f"{rows[0]},pitch_rad,note", *(f"{row},nan,fine" for row in rows[1:])])
    assert read(wider).ignored == ("pitch_rad", "note")


def test_a_position_that_a_velocity_comes_from_is_used(read):
    assert read(GOOD, ("vx",)).fields.keys() == {"x", "vx"}
    assert read(GOOD.replace("position_m", "place"), ("vx",)).ignored == ("place",)


@pytest.mark.parametrize(
    "content",
    [
        "\ufeff" + GOOD.replace(",", " , ").replace("\n", "\r\n") + "\r\n",
        GOOD.replace("\n", ",\n"),
        GOOD.replace("\n", ",\n", 1),
        GOOD.replace("-1\n", "-1,,\n"),
        "\n \n" + GOOD.replace("\n", "\n\n") + ",,,\n",
        GOOD.replace("time_s", '"time_s"').replace("0.1,", '"0.1", '),
        GOOD.rstrip("\n"),
    ],
    ids=["mark, spaces, CRLF", "commas at the end", "in the first line", "in a row", "blank lines", "quotes", "no end"],
)
def test_as_other_programs_write_it(content, read):
    log = read(content)
    np.testing.assert_array_equal(log.time_s, [0, 0.1, 0.2, 0.3])
    np.testing.assert_array_equal(log.reward, [0, -1, -0.9, -0.8])
    assert log.ignored == log.notes == ()


def test_a_positive_reward_can_be_read(read):
    assert read(replaced("-0.9", "0.9")).reward[2] == 0.9


@pytest.mark.parametrize(("unit", "per_second"), [("s", 1), ("ms", 10**3), ("us", 10**6), ("ns", 10**9)])
def test_unix_epochs_count_from_the_first_row(unit, per_second, read):
    start = 1_700_000_000
    rows = [f"{start}.{i}" if unit == "s" else f"{(10 * start + i) * per_second // 10}" for i in range(4)]
    rows = [f"{time},{i},1,-1" for i, time in enumerate(rows)]
    log = read("\n".join([GOOD.splitlines()[0], *rows]), form=Format(time_unit=unit))
    np.testing.assert_allclose(log.time_s, [0, 0.1, 0.2, 0.3], atol=1e-6)
    assert log.notes == ("time_s begins at 1700000000 s; times are counted from there.",)


def test_other_times_stay_as_they_are(read):
    log = read(GOOD.replace("\n0.", "\n7.").replace("\n0,", "\n7,"))
    np.testing.assert_array_equal(log.time_s, [7, 7.1, 7.2, 7.3])
    assert log.notes == ()


def replaced(old, new):
    assert old in GOOD
    return GOOD.replace(old, new)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "is empty"),
        ("\n\n", "is empty"),
        (b"\x89PNG\r\n\xff\xfe\x00", "is not a CSV file"),
        ('time_s,"position_m', "is not a CSV file"),
        (replaced("0.1,0.1", '"0.1"1,0.1'), r"is not a CSV file \(line 3: "),
        (
            GOOD.replace("0.2,0.2", "0.2,0.\xb2").encode("latin-1"),
            "line 4: position_m is '0.\ufffd', not a finite number",
        ),
        ("hello", "lacks time_s, position_m, velocity_m_s, reward.*there are hello"),
        (GOOD.replace(",", "|"), "lacks.*with commas between them"),
        (replaced("velocity_m_s", "speed"), "lacks velocity_m_s.*needs.*there are time_s, position_m, speed, reward"),
        (replaced("velocity_m_s", "position_m"), "column position_m more than once"),
        (replaced("0.1,0.1,1,-1", "0.1,0.1,1"), "line 3: 3 cells where the first line names 4 columns"),
        (replaced("0.1,0.1,1,-1", "0.1,far,1,-1"), "line 3: position_m is 'far', not a finite number"),
        (replaced("0.1,0.1,1,-1", "0.1,0.1,,-1"), "line 3: velocity_m_s is '', not a finite number"),
        (replaced("0.1,0.1,1,-1", "0.1,0.1,1,nan"), "line 3: reward is 'nan', not a finite number"),
        (replaced("0.1,0.1,1,-1", "\ninf,0.1,1,-1"), "line 4: time_s is 'inf', not a finite number"),
        (replaced("0.3,0.3", "0.2,0.3"), r"line 5: time_s is 0\.2 after 0\.2; time must ascend"),
        (replaced("0.1,0.1", "-0.1,0.1"), r"line 3: time_s is -0\.1 after 0; time must ascend"),
        (GOOD + "0.61,0.4,1,-0.7\n", r"line 6: no sample for 0\.31 s before this one; at most 0\.3 s may pass"),
        ("time_s,position_m,velocity_m_s,reward\n0,0,0,0\n0.2,0,0,0\n0.4,0,0,0\n", r"a row every 0\.2 s"),
        ("time_s,position_m,velocity_m_s,reward\n0,0,0,0\n50,0,0,0\n100,0,0,0\n", "Read it with --time-unit ms"),
        ("time_s,position_m,velocity_m_s,reward\n0,0,0,0\n0.1,0,0,0\n", r"too short: 2 rows over 0\.1 s"),
        ("time_s,position_m,velocity_m_s,reward\n0,0,0,0\n", "too short: 1 rows over 0 s"),
        ("time_s,position_m,velocity_m_s,reward\n", "too short: 0 rows"),
        (replaced("-0.9", "-1e7"), r"line 4: reward is '-1e7', larger than any that can be \(1e\+06 either way\)"),
        (replaced("-0.9", "9" * 400), r"line 4: reward is '9{37}\.\.\.', larger than any that can be"),
    ],
)
def test_what_is_wrong_and_where(content, says, read):
    with pytest.raises(RebodyError, match=says):
        read(content)


def test_no_file(tmp_path):
    with pytest.raises(RebodyError, match="there is no log"):
        read_log(tmp_path / "none.csv", ("x",))


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir], ids=["pipe", "folder"])
def test_what_is_no_regular_file(make, tmp_path):
    make(tmp_path / "log.csv")
    with pytest.raises(RebodyError, match="a regular file is needed here"):
        read_log(tmp_path / "log.csv", ("x",))


def test_a_file_that_would_fill_the_memory(tmp_path):
    with (tmp_path / "log.csv").open("wb") as file:
        file.truncate(10**9)  # sparse: takes no space
    with pytest.raises(RebodyError, match="is larger than 500 MB"):
        read_log(tmp_path / "log.csv", ("x",))


def test_every_field_that_a_module_may_see_has_a_column():
    assert set(COLUMNS) == set(GLOBAL_FIELDS)
