"""Decisions that a log spans, and those that a gap reaches into."""

import numpy as np
import pytest

from rebody.evaluation.logs.ticks import decisions_within, gaps_in, heard, ticks_of

EPOCH = 1_700_000_000.0


@pytest.mark.parametrize("start", [0.0, 0.3, 1234.56, EPOCH])
def test_tenths_of_a_second_are_whole_decisions(start):
    time = start + np.arange(8) / 10
    assert decisions_within(time) == 7
    np.testing.assert_allclose(ticks_of(time), time, atol=1e-6)


@pytest.mark.parametrize("start", [0.0, 0.7, EPOCH])
def test_three_tenths_are_no_gap(start):
    time = start + np.array([0.0, 0.1, 0.4, 0.7, 1.0])
    assert gaps_in(time).size == 0
    assert heard(time).all()


@pytest.mark.parametrize(
    ("begin", "end", "unheard"),
    [(0.5, 1.0, range(5, 10)), (0.52, 1.0, range(5, 10)), (0.5, 0.95, range(5, 10)), (0.48, 1.02, range(4, 11))],
)
def test_decisions_that_a_gap_reaches_into(begin, end, unheard):
    time = np.concatenate([np.linspace(0, begin, 11), np.linspace(end, 2.0, 21)])
    np.testing.assert_array_equal(np.flatnonzero(~heard(time)), unheard)
