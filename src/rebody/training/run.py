"""What every training run shares: checkpoints, resuming, logs, progress, a clean stop.

A pipeline gives a declared state with an `iteration` and a function that takes one turn; everything here
is about not losing what it does.
"""

import csv
import io
import json
import signal
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass, field
from itertools import accumulate
from pathlib import Path
from typing import IO, Annotated, Any, Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Float
from msgspec import Meta

from rebody.errors import RebodyError
from rebody.ranges import check_seed
from rebody.store import holds_checkpoint, load_checkpoint, recover, save_checkpoint, take_folder, tree_to_arrays
from rebody.store.artifact import MANIFEST
from rebody.store.checkpoint import FOLDER
from rebody.store.folders import check_space
from rebody.store.typed import Misfit, typed
from rebody.training.curves import Curves
from rebody.training.progress import Metrics, progress

SHOWN_FAULTS = 5


@runtime_checkable  # tests check types as they run
class RunState(Protocol):
    """Everything that a resumed run needs: a pytree that counts its iterations."""

    iteration: Any


State = TypeVar("State", bound=RunState)


class Interrupted(Exception):
    """Ctrl-C during training; the run is checkpointed."""


@dataclass(frozen=True)
class RunMeta:
    """What a checkpoint says beside the state."""

    settings: dict[str, Any]
    """That identify the run."""
    wall_s: Annotated[float, Meta(ge=0)]
    """Seconds of training so far."""
    history: list[dict[str, float]]
    """What every iteration measured."""
    changes: list[str] = field(default_factory=list)
    """How the run's length was changed in the middle of it."""


class Run:
    """One training run in a folder, which is its own from `restore` to the end of the `with` block."""

    def __init__(
        self,
        out: Path,
        settings: dict[str, Any],
        *,
        length: Sequence[str] = ("iterations",),
        resume: bool = False,
        finish: bool = False,
        checkpoint_every_s: float = 120.0,
    ):
        """`settings` identify the run: a checkpoint made with others is not resumed.

        But for those called `length`, numbers of iterations that follow one another: what is still to come of them may
        change. With `finish` no iteration is taken: what was done is all.
        """
        check_seed(settings.get("seed", 0))
        self.out = out
        self.settings = json.loads(json.dumps(settings))
        self.resume = resume or finish
        self.finish = finish
        self.checkpoint_every_s = checkpoint_every_s
        self.wall_s = 0.0
        """Seconds of training so far, over all resumptions."""
        self.history: list[Metrics] = []
        """What every iteration measured."""
        self.changes: list[str] = []
        """How its length was changed in the middle of it."""
        self._length = length
        self._lock: IO[bytes] | None = None
        self._check_folder()

    def __enter__(self) -> "Run":
        return self

    def __exit__(self, *_: object) -> None:
        if self._lock is not None:
            self._lock.close()

    def _check_folder(self) -> None:
        if self.out.exists() and not self.out.is_dir():
            raise RebodyError(f"{self.out} is a file; a run needs a folder. Choose another --out.")
        if not next(parent for parent in self.out.absolute().parents if parent.exists()).is_dir():
            raise RebodyError(f"{self.out} lies below a file; a run needs a folder. Choose another --out.")
        if not self.resume and ((self.out / FOLDER).exists() or (self.out / MANIFEST).exists()):
            raise RebodyError(
                f"{self.out} already holds a run. Add --resume to go on with it, or choose another --out."
            )
        if self.finish and not holds_checkpoint(self.out):
            raise RebodyError(f"{self.out} holds no checkpoint of a run that --finish could make an artifact of.")

    def restore(self, state: State) -> State:
        """Take the folder; the checkpointed state if this run is resumed and has one, else the given fresh one.

        RebodyError if another run has the folder, or nothing can be saved there: before training, not after it.
        """
        self._lock = take_folder(self.out)
        self._check_folder()  # again: now nobody else changes it
        recover(self.out)
        found = load_checkpoint(self._checkpoint, state, self._check_settings) if self.resume else None
        # a checkpoint is written beside the one before it
        size = sum(array.nbytes for array in tree_to_arrays(state).values())
        check_space(self.out, size if found else 2 * size)
        if found is None:
            return state
        state, meta = found[0], self._understood(found[1])
        if int(state.iteration) != len(meta.history) or _faults(state):
            raise self._foreign("its state is not that of its history, or not finite")
        self.wall_s, self.history, self.changes = meta.wall_s, meta.history, meta.changes
        before = {name: meta.settings[name] for name in self._length}
        if self.finish:
            self.settings |= before
        elif before != self.length:
            self.changes.append(f"{_written(before)} until iteration {self.iterations}, then {_written(self.length)}")
        return state

    def _understood(self, said: Any) -> RunMeta:
        try:
            meta = typed(said, RunMeta)
        except Misfit as misfit:
            raise self._foreign(str(misfit)) from misfit
        for name in self._length:
            turns = meta.settings.get(name)
            if type(turns) is not int or turns < 0:
                raise self._foreign(f"settings.{name}: a number of iterations is needed")
        return meta

    def _foreign(self, what: str) -> RebodyError:
        return RebodyError(
            f"the checkpoint in {self._checkpoint} is not understood ({what}): another release of rebody made it, or "
            "it is damaged. Go on with that release, or choose another --out."
        )

    def _check_settings(self, said: dict[str, Any]) -> None:
        meta = self._understood(said)
        before, now, done = meta.settings, self.settings, len(meta.history)
        changed = {name for name in before.keys() | now.keys() if before.get(name) != now.get(name)}
        if others := sorted(changed.difference(self._length)):
            raise RebodyError(
                f"cannot resume {self.out}: it was begun with other settings ({', '.join(others)}). "
                "Use the same ones, or choose another --out."
            )
        if changed and not self.finish and self._ends(before, done) != self._ends(now, done):
            raise RebodyError(
                f"cannot resume {self.out}: {done} iterations are done, and {_written(self.length)} would undo some of "
                f"them (before: {_written({name: before[name] for name in self._length})}). Change what is still to "
                "come only, or make an artifact of what is done with --finish."
            )

    def _ends(self, settings: dict[str, Any], done: int) -> list[int]:
        """When each part of the run ends, as far as it is done."""
        return [min(end, done) for end in accumulate(settings[name] for name in self._length)]

    def training(self, config: Any) -> dict[str, Any]:
        """What its artifact says of it: settings, seed, and seconds of training."""
        return asdict(config) | self.length | {"seed": self.settings["seed"], "wall_s": self.wall_s}

    @property
    def length(self) -> dict[str, int]:
        """The settings that say how long the run is, or was to be."""
        return {name: self.settings[name] for name in self._length}

    @property
    def iterations(self) -> int:
        """How many are done."""
        return len(self.history)

    @property
    def remarks(self) -> list[str]:
        """What its artifact's card must say, since its command alone does not lead to it."""
        planned = sum(self.length.values())
        stopped = [f"Unfinished: stopped after {self.iterations} of {planned} iterations"]
        return [f"Length: {change}" for change in self.changes] + (stopped if self.iterations < planned else [])

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
        if self.finish:
            return state
        begun, saved = time.monotonic() - self.wall_s, time.monotonic()
        with (
            progress(label, iterations, int(state.iteration)) as show,
            _interrupts() as interrupted,
            closing(Curves(self.out / "events", int(state.iteration) + 1)) as curves,
        ):
            while int(state.iteration) < iterations:
                state, metrics = iterate(state)
                _check_finite(metrics, self.out)
                self.wall_s = time.monotonic() - begun
                self._log(curves, metrics, int(state.iteration))
                show(int(state.iteration), metrics)
                if interrupted() or time.monotonic() - saved > self.checkpoint_every_s:
                    self._save(state)
                    curves.flush()
                    saved = time.monotonic()
                if interrupted():
                    raise Interrupted(f"stopped; go on with the same command and --resume ({self.out})")
        self._save(state)
        return state

    @property
    def _checkpoint(self) -> Path:
        return self.out / FOLDER

    def _save(self, state: RunState) -> None:
        _check_finite(_faults(state), self.out)  # the last update may have broken what no loss shows yet
        meta = RunMeta(self.settings, self.wall_s, self.history, self.changes)
        save_checkpoint(self._checkpoint, state, asdict(meta))

    def _log(self, curves: Curves, metrics: Metrics, iteration: int) -> None:
        self.history.append(metrics)
        curves.add(metrics, iteration)


def measured(
    metrics: dict[str, Any], iteration: int, every: int, evaluate: Callable[[], Mapping[str, float]]
) -> Metrics:
    """Metrics of an iteration as numbers, with those of an evaluation after each `every` iterations."""
    is_due = (iteration + 1) % every == 0
    figures = {f"evaluation/{name}": value for name, value in evaluate().items()} if is_due else {}
    return {name: float(value) for name, value in (metrics | figures).items()}


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


def _written(length: dict[str, int]) -> str:
    return ", ".join(f"{name} {value}" for name, value in length.items())


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
