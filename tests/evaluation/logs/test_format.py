"""A file that is written in another way is read with the options that the error names."""

import numpy as np
import pytest

from rebody.errors import RebodyError
from rebody.evaluation.logs import Format, read_log

TIME = 0.05 * np.arange(9)
NAMES = ("time_s", "position_m", "velocity_m_s", "reward")
PLAIN = Format()
SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}


@pytest.fixture
def write(tmp_path):
    """A function: how it is written -> a log of a body that runs at 0.5 m/s."""

    def write(form=PLAIN, every=0.05, quoted=False):
        between = SEPARATORS[form.delimiter]
        unit = {"s": 1, "ms": 1000, "us": 1e6, "ns": 1e9}[form.time_unit]
        rows = [(f"{unit * every * i:.10g}", f"{0.025 * i:.4f}", "0.5", "-0.25") for i in range(9)]
        rows = [[cell.replace(".", ",") if form.decimal_comma else cell for cell in row] for row in rows]
        if quoted:
            rows = [NAMES, *rows]
            text = "\n".join(between.join(f'"{cell}"' for cell in row) for row in rows)
        else:
            text = "\n".join(between.join(row) for row in [NAMES, *rows])
        path = tmp_path / "log.csv"
        path.write_text(text + "\n")
        return path

    return write


FORMATS = [
    Format(delimiter, comma, unit)
    for delimiter in SEPARATORS
    for comma in (False, True)
    for unit in ("s", "ms", "us", "ns")
    if (delimiter, comma) != ("comma", True)
]


def test_is_read_alike(write):
    plain = read_log(write(), ("x", "vx"))
    for form in FORMATS:
        log = read_log(write(form), ("x", "vx"), form)
        np.testing.assert_array_equal(log.time_s, plain.time_s)
        np.testing.assert_array_equal(log.fields["x"], plain.fields["x"])
        np.testing.assert_array_equal(log.reward, plain.reward)


@pytest.mark.parametrize("skip", [False, True])
def test_the_error_names_all_options(write, skip):
    for form in FORMATS[1:]:
        with pytest.raises(RebodyError, match=f"Read it with {form.options}\\.$"):
            read_log(write(form), ("x", "vx"), skip_bad_rows=skip)


def test_it_says_what_was_found(write):
    found = r"has semicolons between its columns, decimal commas, times that look like milliseconds "
    with pytest.raises(RebodyError, match=found + r"\(a row every 50\)"):
        read_log(write(Format("semicolon", True, "ms")), ("x",))


def test_options_that_the_file_does_not_need(write):
    for form in (Format("semicolon"), Format(decimal_comma=True), Format("tab", True)):
        with pytest.raises(RebodyError, match=f"Read it without {form.options}"):
            read_log(write(), ("x",), form)


def test_one_of_two_options_is_given(write):
    path = write(Format("semicolon", True))
    with pytest.raises(RebodyError, match=r"has decimal commas\. Read it with --delimiter semicolon --decimal-comma"):
        read_log(path, ("x",), Format("semicolon"))


def test_quoted_cells(write):
    comma = Format(decimal_comma=True)
    log = read_log(write(comma, quoted=True), ("x",), comma)
    np.testing.assert_allclose(log.time_s, TIME)
    with pytest.raises(RebodyError, match=r"has decimal commas\. Read it with --decimal-comma"):
        read_log(write(comma, quoted=True), ("x",))
    with pytest.raises(RebodyError, match="has semicolons between"):
        read_log(write(Format("semicolon"), quoted=True), ("x",))


def test_decimal_commas_between_commas_cannot_be_told_apart(write):
    with pytest.raises(RebodyError, match="decimal commas need another delimiter between cells"):
        read_log(write(Format(decimal_comma=True)), ("x",))


@pytest.mark.parametrize("every", [1.0, 0.2])
def test_a_coarse_log_is_not_taken_for_one_in_milliseconds(write, every):
    with pytest.raises(RebodyError, match=rf"a row every {every:g} s.*time_s is in seconds"):
        read_log(write(every=every), ("x",))


def test_whole_numbers_fit_either_notation(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time_s,position_m,reward\n" + "".join(f"{50 * i},{i},{-i}\n" for i in range(9)))
    for comma in (False, True):
        assert len(read_log(path, ("x",), Format(decimal_comma=comma, time_unit="ms")).time_s) == 9


def test_a_long_file_is_told_by_its_start(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time_s,position_m,reward\n" + "".join(f"{0.05 * i:.2f},{i},{-i}\n" for i in range(20_000)))
    assert len(read_log(path, ("x",)).time_s) == 20_000
    with pytest.raises(RebodyError, match="Read it without --delimiter tab"):
        read_log(path, ("x",), Format("tab"))
