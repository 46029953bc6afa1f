"""The examples do what they say."""

import csv
import importlib.util
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


def load(name):
    spec = importlib.util.spec_from_file_location(Path(name).stem, EXAMPLES / name)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_believing():
    end, believed = load("believing.py").walk(-4.0)
    assert believed == pytest.approx(-4.0, abs=0.3)
    assert end == pytest.approx(-4.0, abs=0.3)


def test_the_log_is_what_its_script_makes(tmp_path):
    load("logs/record.py").record(tmp_path / "log.csv", seconds=0.3)
    with (tmp_path / "log.csv").open() as made, (EXAMPLES / "logs" / "cheetah.csv").open() as shipped:
        made, shipped = list(csv.reader(made)), list(csv.reader(shipped))
    assert made[0] == shipped[0]
    assert [row[0] for row in made] == [row[0] for row in shipped[: len(made)]]
    assert len(shipped) == 402


def test_driving():
    *_, last = load("driving.py").drive((("goal", 2.0),), 4.0)
    time, task, (family, target), x, _ = last
    assert (time, task, family) == (pytest.approx(4.0), ("goal", 2.0), "goal")
    assert target == pytest.approx(2.0, abs=0.2)
    assert x == pytest.approx(2.0, abs=0.2)
