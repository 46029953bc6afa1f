"""What every training run shares: checkpoints, resuming, logs, progress, a clean stop.

A pipeline gives a declared state with an `iteration` and a function that takes one turn; everything here
is about not losing what it does.
"""

import csv
import io
import json
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Float
from tensorboardX import SummaryWriter

from rebody.errors import RebodyError
from rebody.store import load_checkpoint, recover, save_checkpoint, tree_to_arrays
from rebody.training.progress import Metrics, progress

SHOWN_FAULTS = 5


@runtime_checkable  # tests check types as they run
class RunState(Protocol):
    """Everything that a resumed run needs: a pytree that counts its iterations."""

    iteration: Any


State = TypeVar("State", bound=RunState)


class Interrupted(Exception):
    """Ctrl-C during training; the run is checkpointed."""


class Run:
    """One training run in a folder."""

    def __init__(self, out: Path, settings: dict[str, Any], *, resume: bool = False, checkpoint_every_s: float = 120.0):
        """`settings` identify the run: a checkpoint made with others is not resumed."""
        self.out = out
        self.settings = json.loads(json.dumps(settings))
        self.resume = resume
        self.checkpoint_every_s = checkpoint_every_s
        self.wall_s = 0.0
        """Seconds of training so far, over all resumptions."""
        self.history: list[Metrics] = []
        """What every iteration measured."""
        recover(out)
        if out.exists() and not out.is_dir():
            raise RebodyError(f"{out} is a file; a run needs a folder. Choose another --out.")
        if not resume and ((out / "checkpoint").exists() or (out / "manifest.json").exists()):
            raise RebodyError(f"{out} already holds a run. Add --resume to go on with it, or choose another --out.")

    def restore(self, state: State) -> State:
        """The checkpointed state if this run is resumed and has one, else the given fresh one."""
        found = load_checkpoint(self._checkpoint, state, self._check_settings) if self.resume else None
        if found is None:
            return state
        state, meta = found
        self.wall_s, self.history = meta["wall_s"], meta["history"]
        return state

    def _check_settings(self, meta: dict[str, Any]) -> None:
        if meta["settings"] != self.settings:
            changed = sorted(
                name
                for name in meta["settings"].keys() | self.settings.keys()
                if meta["settings"].get(name) != self.settings.get(name)
            )
            raise RebodyError(
                f"cannot resume {self.out}: it was begun with other settings ({', '.join(changed)}). "
                "Use the same ones, or choose another --out."
            )

    @property
    def log(self) -> str:
        """CSV: a row per iteration, an empty field where nothing was measured."""
        names = list(dict.fromkeys(name for metrics in self.history for name in metrics))
        table = io.StringIO()
        writer = csv.DictWriter(table, ["iteration", *names], lineterminator="\n")
        writer.writeheader()
        for i, metrics in enumerate(self.history):
            writer.writerow({"iteration": i + 1} | {name: f"{value:.6g}" for name, value in metrics.items()})
        return table.getvalue()

    def loop(
        self, state: State, iterate: Callable[[State], tuple[State, Metrics]], iterations: int, label: str
    ) -> State:
        """Take turns until `iterations` are done; Interrupted after Ctrl-C, RebodyError if a loss diverges."""
        begun, saved = time.monotonic() - self.wall_s, time.monotonic()
        with (
            progress(label, iterations, int(state.iteration)) as show,
            _interrupts() as interrupted,
            # a killed run has told of turns that it takes again
            SummaryWriter(str(self.out / "events"), purge_step=int(state.iteration) + 1) as writer,
        ):
            while int(state.iteration) < iterations:
                state, metrics = iterate(state)
                _check_finite(metrics, self.out)
                self.wall_s = time.monotonic() - begun
                self._log(writer, metrics, int(state.iteration))
                show(int(state.iteration), metrics)
                if interrupted() or time.monotonic() - saved > self.checkpoint_every_s:
                    self._save(state)
                    saved = time.monotonic()
                if interrupted():
                    raise Interrupted(f"stopped; go on with the same command and --resume ({self.out})")
        self._save(state)
        return state

    @property
    def _checkpoint(self) -> Path:
        return self.out / "checkpoint"

    def _save(self, state: RunState) -> None:
        _check_finite(_faults(state), self.out)  # the last update may have broken what no loss shows yet
        meta = {"settings": self.settings, "wall_s": self.wall_s, "history": self.history}
        save_checkpoint(self._checkpoint, state, meta)

    def _log(self, writer: SummaryWriter, metrics: Metrics, iteration: int) -> None:
        self.history.append(metrics)
        for name, value in metrics.items():
            writer.add_scalar(name, value, iteration)


def read_log(text: str) -> dict[str, Float[np.ndarray, " iteration"]]:
    """The columns of a `Run.log`, NaN where nothing was measured."""
    table = csv.DictReader(io.StringIO(text))
    rows = list(table)
    return {name: np.array([float(row[name] or "nan") for row in rows]) for name in table.fieldnames or ()}


@contextmanager
def _interrupts() -> Iterator[Callable[[], bool]]:
    """While inside, Ctrl-C is noted instead of raised, so that a turn is never cut in half."""
    noted = False

    def note(*_: object) -> None:
        nonlocal noted
        noted = True

    before = signal.signal(signal.SIGINT, note)
    try:
        yield lambda: noted
    finally:
        signal.signal(signal.SIGINT, before)


def _faults(state: RunState) -> Metrics:
    """NaN under the name of every array of the state that is not finite."""
    return {name: np.nan for name, array in tree_to_arrays(state).items() if not np.isfinite(array).all()}


def _check_finite(metrics: Metrics, out: Path) -> None:
    bad = [name for name, value in metrics.items() if not np.isfinite(value)]
    if bad:
        more = f" and {len(bad) - SHOWN_FAULTS} more" if len(bad) > SHOWN_FAULTS else ""
        raise RebodyError(
            f"training diverged: not finite: {', '.join(bad[:SHOWN_FAULTS])}{more}. "
            f"Any checkpoint in {out} is from before; try a smaller learning rate."
        )
