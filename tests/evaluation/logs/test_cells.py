"""Numbers of a log: decimal notation only."""

import math

import pytest

from rebody.evaluation.logs.cells import is_not_finite, number


@pytest.mark.parametrize(
    ("cell", "value"),
    [("0", 0.0), ("-1.5", -1.5), ("+2.", 2.0), (".25", 0.25), ("1e-05", 1e-5), ("2E+3", 2000.0), ("007", 7.0)],
)
def test_decimal_notation(cell, value):
    assert number(cell) == value
    assert number(cell.replace(".", ","), decimal_comma=True) == value


@pytest.mark.parametrize(
    "cell",
    [
        "",
        "far",
        "1_0",
        "0x1F",
        "nan",
        "inf",
        "-Infinity",
        "1.0.0",
        "1e",
        "e5",
        ".",
        "--1",
        "1 0",
        "0,5",
        "1,234.5",
        "٣",
    ],
)
def test_what_is_no_number(cell):
    assert math.isnan(number(cell))


@pytest.mark.parametrize("cell", ["0.5", "1.234,5", "1,2,3", ","])
def test_what_is_no_number_with_decimal_commas(cell):
    assert math.isnan(number(cell, decimal_comma=True))


def test_nan_and_infinity_are_told_from_what_is_unreadable():
    assert [is_not_finite(cell) for cell in ("NaN", "-inf", "Infinity", "nano", "")] == [True] * 3 + [False] * 2


def test_a_long_cell_takes_no_time():
    assert math.isnan(number("1" * 100_000 + "x"))
