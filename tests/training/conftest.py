"""Tiny runs of both pipelines, in this process and through the command line."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import pytest
import safetensors.numpy

from rebody.cli.main import run
from rebody.store import load_artifact, tree_hash
from rebody.training.inference import report as inference_report
from rebody.training.inference import train as inference_train
from rebody.training.run import Run
from rebody.training.tracker import report as tracker_report
from rebody.training.tracker import train as tracker_train

TRACKER = """
    train tracker --robot cheetah --robots 4 --steps 4 --updates 2 --iterations 9 --replay 60
    --sac.hidden 8 8 --sac.batch-size 8
"""
INFERENCE = """
    train inference --episodes 8 --decisions 24 --groups 2
    --wander-iterations 1 --joint-iterations 2 --policy-iterations 6 --inference-updates 2 --policy-updates 2
    --inference.units 8 --inference.window 4 --inference.batch-size 4 --inference.decoded 2
    --sac.hidden 8 8 --sac.projections 2 --sac.batch-size 8
"""


@dataclass(frozen=True)
class Pipeline:
    """One kind of training."""

    name: str
    """Kind of the artifact that it makes."""
    arguments: list[str]
    """Command line of a tiny run, without --out."""
    train: ModuleType
    """Where its `iterate` is."""

    def __call__(self, out: Path, *more: object) -> int:
        """Run the command in this process; its exit code."""
        return run([*self.arguments, "--out", str(out), *map(str, more)])

    def weights(self, out: Path) -> dict:
        """What the artifact of a finished run holds."""
        return load_artifact(out, self.name).arrays

    def end(self, out: Path) -> tuple[str, str]:
        """Hashes of the artifact and of the whole state that a finished run ended in."""
        return tree_hash(self.weights(out)), tree_hash(checkpoint(out))


def checkpoint(out: Path) -> dict:
    """Arrays of a run's checkpoint."""
    return safetensors.numpy.load_file(out / "checkpoint" / "checkpoint.safetensors")


PIPELINES = {
    "tracker": Pipeline("tracker", TRACKER.split(), tracker_train),
    "inference": Pipeline("inference", INFERENCE.split(), inference_train),
}


@pytest.fixture(scope="session")
def pipelines() -> dict[str, Pipeline]:
    """Both, by name."""
    return PIPELINES


@pytest.fixture(params=PIPELINES)
def pipeline(request, monkeypatch) -> Pipeline:
    """Each of the two, measured in short when it has finished."""
    monkeypatch.setattr(tracker_report, "COMMANDS", 4)
    monkeypatch.setattr(tracker_report, "SECONDS", 3.0)
    monkeypatch.setattr(inference_report, "HELD_OUT", 8)
    monkeypatch.setattr(inference_report, "DECISIONS", 40)
    monkeypatch.setattr(sys, "argv", ["rebody"])
    return PIPELINES[request.param]


@pytest.fixture
def after_turn(monkeypatch) -> Callable[[int, Callable[[], object]], None]:
    """A function (turn, action) that lets the action happen in every run at the end of that turn."""

    def arrange(turn: int, action: Callable[[], object]) -> None:
        log = Run._log

        def log_and_act(self, writer, metrics, iteration):
            log(self, writer, metrics, iteration)
            if iteration == turn:
                action()

        monkeypatch.setattr(Run, "_log", log_and_act)

    return arrange


@pytest.fixture
def read_checkpoint() -> Callable[[Path], dict]:
    """`checkpoint`, for tests."""
    return checkpoint
