"""Logs to be read."""

import csv

import numpy as np
import pytest

from rebody.evaluation.logs import read_log

FIELDS = ("x", "vx")


@pytest.fixture
def write(tmp_path):
    """A function: columns by name -> path of a CSV."""

    def write(**columns):
        path = tmp_path / "log.csv"
        with path.open("w", newline="") as file:
            csv.writer(file).writerow(columns)
            csv.writer(file).writerows(zip(*columns.values(), strict=True))
        return path

    return write


@pytest.fixture
def log(write):
    """A function: what differs -> a log of a body that goes to 3 m, with a row every `every` seconds."""

    def log(fields=FIELDS, every=0.05, seconds=2.0, **different):
        time = every * np.arange(round(seconds / every) + 1)
        x, vx = 3 * (1 - np.exp(-time)), 3 * np.exp(-time)
        columns = {"time_s": time, "position_m": x, "velocity_m_s": vx, "reward": -np.abs(x - 3) / 3} | different
        return read_log(write(**columns), fields)

    return log
