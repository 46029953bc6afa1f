"""Tiny runs of every pipeline, in this process and through the command line."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import pytest
import safetensors.numpy

from rebody.cli.main import run
from rebody.store import load_artifact, tree_hash
from rebody.training import off_policy
from rebody.training.inference import train as inference_train
from rebody.training.run import Run
from rebody.training.scratch import train as scratch_train

KINDS = ("tracker", "inference", "flat", "scratch", "step-predictor")


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


@pytest.fixture(scope="session")
def pipelines(tiny_training) -> dict[str, Pipeline]:
    """All of them, by name."""
    modules = (off_policy, inference_train, off_policy, scratch_train, off_policy)
    return {kind: Pipeline(kind, tiny_training[kind], module) for kind, module in zip(KINDS, modules, strict=True)}


@pytest.fixture(params=KINDS)
def pipeline(request, pipelines, monkeypatch) -> Pipeline:
    """Each of them."""
    monkeypatch.setattr(sys, "argv", ["rebody"])
    return pipelines[request.param]


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
