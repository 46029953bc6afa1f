"""Logs are read as they are, or refused with what is wrong and where."""

import numpy as np
import pytest

from rebody.errors import RebodyError
from rebody.evaluation.logs import read_log

GOOD = "time_s,position_m,velocity_m_s,reward\n0,0,0,0\n0.1,0.1,1,-1\n0.2,0.2,1,-0.9\n0.3,0.3,1,-0.8\n"


@pytest.fixture
def read(tmp_path):
    def read(content, fields=("x", "vx")):
        path = tmp_path / "log.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_log(path, fields)

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


def test_as_other_programs_write_it(read):
    read("\ufeff" + GOOD.replace(",", " , ").replace("\n", "\r\n") + "\r\n")


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
        ("hello", "lacks time_s, position_m, velocity_m_s, reward.*there are hello"),
        (GOOD.replace(",", ";"), "lacks.*with commas between them"),
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
        ("time_s,position_m,velocity_m_s,reward\n0,0,0,0\n50,0,0,0\n100,0,0,0\n", "time_s is in seconds"),
        ("time_s,position_m,velocity_m_s,reward\n0,0,0,0\n0.1,0,0,0\n", r"too short: 2 rows over 0\.1 s"),
        ("time_s,position_m,velocity_m_s,reward\n0,0,0,0\n", "too short: 1 rows over 0 s"),
        ("time_s,position_m,velocity_m_s,reward\n", "too short: 0 rows"),
        (replaced("-0.9", "0.9"), r"line 4: reward is 0\.9; rewards are -\|error\|, never above 0"),
    ],
)
def test_what_is_wrong_and_where(content, says, read):
    with pytest.raises(RebodyError, match=says):
        read(content)


def test_no_file(tmp_path):
    with pytest.raises(RebodyError, match="there is no log"):
        read_log(tmp_path / "none.csv", ("x",))
