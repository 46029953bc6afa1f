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


def test_driving():
    """The task changes in mid-episode; what is believed follows."""
    seen = list(load("driving.py").drive((("goal", 2.0), ("velocity", -1.5)), seconds=2.0))
    assert [time for time, *_ in seen] == pytest.approx([1.0, 2.0, 3.0, 4.0])
    for _, (family, target), believed, *_ in (seen[1], seen[3]):
        assert believed == (family, pytest.approx((target,), abs=0.3))


def test_baselines():
    pytest.importorskip("stable_baselines3")
    example = load("baselines.py")
    model = example.train(steps=150)  # the first 100 only look around
    assert model.num_timesteps == 150
    [error] = example.final_errors(model, goals=(1.0,))
    assert 0.0 <= error < 80.0  # no farther than 20 s at full speed


def test_the_log_is_what_its_script_makes(tmp_path):
    load("logs/record.py").record(tmp_path / "log.csv", seconds=0.3)
    with (tmp_path / "log.csv").open() as made, (EXAMPLES / "logs" / "cheetah.csv").open() as shipped:
        made, shipped = list(csv.reader(made)), list(csv.reader(shipped))
    assert made[0] == shipped[0]
    assert [row[0] for row in made] == [row[0] for row in shipped[: len(made)]]
    assert len(shipped) == 402
