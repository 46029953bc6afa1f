"""Hundreds of malformed task files, logs and command lines: each is one message, or was fine after all."""

import importlib
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
INPUTS = 400


@pytest.fixture(scope="module")
def faults():
    with pytest.MonkeyPatch.context() as patched:
        patched.syspath_prepend(BENCHMARKS)
        module = importlib.import_module("faults")
        patched.setattr(module, "PATIENCE_S", 60.0)  # for a slow machine that has other work
        yield module


@pytest.fixture(scope="module")
def malformed(faults):
    return importlib.import_module("malformed")


def test_nothing_malformed_ends_in_a_traceback_a_hang_or_gigabytes(faults, malformed, tmp_path):
    with faults.ready(tmp_path):
        outcomes = [(case, faults.attempt(case)) for case in malformed.draw(np.random.default_rng(7), tmp_path, INPUTS)]
    assert len(outcomes) == INPUTS
    bad = [(case, *outcome) for case, outcome in outcomes if outcome[0] not in ("refused", "accepted")]
    assert bad == []
    # it would prove nothing if all were refused for one and the same reason
    assert sum(outcome[0] == "accepted" for _, outcome in outcomes) > INPUTS // 20


def test_a_fault_would_be_seen(faults, malformed, tmp_path, monkeypatch):
    def break_down(*_):
        raise IndexError

    with faults.ready(tmp_path):
        malformed.make_odd_files(tmp_path)
        monkeypatch.setattr("rebody.cli.evaluate.read_tasks", break_down)
        case = malformed.Case("", ["evaluate", "--tasks", "good.json", *malformed.ON_TOY], is_wrong=True)
        assert faults.attempt(case)[0] == "traceback"
        monkeypatch.undo()
        assert faults.attempt(case)[0] == "accepted, though wrong"
