"""Malformed task files, logs, artifacts, command lines: one message for each, never a traceback, hang or gigabytes.

    .venv/bin/python benchmarks/faults.py [--inputs 5000] [--seed 0]

All run in this process through the command line's own entry. Training and episodes stop where they would begin: what
gets there was accepted. An input is a good one with something changed; where the change is sure to be wrong, being
accepted is a fault, too. Exit code 1 if there was one.
"""

import argparse
import contextlib
import io
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

import numpy as np
from malformed import Case, draw
from rich.console import Console
from rich.progress import track
from rich.table import Table

PATIENCE_S, MOST_GB = 10.0, 2.0
WORK = {
    "rebody.evaluation.evaluate.run_trial": "episodes",
    "rebody.training.run.Run.loop": "training",
    "rebody.cli.stress.stress": "episodes",
    "rebody.cli.figure.make_figure": "a figure",
    "rebody.viewer.server.serving": "the page",
}
"""Where commands begin to work."""


class Accepted(BaseException):
    """The input got to where work begins."""


class Hang(BaseException):
    """It took too long."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inputs", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    console, faults, outcomes = Console(), [], Counter()
    begun = time.monotonic()
    with tempfile.TemporaryDirectory() as folder, ready(Path(folder)):
        cases = draw(np.random.default_rng(options.seed), Path(folder), options.inputs)
        for case in track(cases, total=options.inputs, console=console, description="inputs"):
            outcome, detail = attempt(case)
            outcomes[case.kind, outcome] += 1
            if outcome not in ("refused", "accepted"):
                faults.append((case, outcome, detail))
    show(outcomes, console)
    for case, outcome, detail in faults:
        console.print(f"{outcome}: rebody {' '.join(map(repr, case.arguments))[:300]}\n{detail}", markup=False)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    console.print(
        f"{len(faults)} faults in {options.inputs} inputs, {time.monotonic() - begun:.0f} s, at most {peak:.1f} GB"
    )
    sys.exit(bool(faults))


@contextlib.contextmanager
def ready(folder: Path) -> Iterator[None]:
    """While inside, work is not done, and what is written goes to the folder."""
    import rebody.cli.commands

    for command in rebody.cli.commands.COMMANDS:
        command.load([])  # all are imported before they are patched

    def accept(*_: object, **__: object) -> None:
        raise Accepted

    with contextlib.ExitStack() as stack:
        stack.enter_context(contextlib.chdir(folder))
        for name in WORK:
            stack.enter_context(patch(name, accept))
        yield


def attempt(case: Case) -> tuple[str, str]:
    """What becomes of a case: refused, accepted, or a fault, with what is to be known about it."""
    from rebody.cli.main import run

    def interrupt(*_: object) -> None:
        raise Hang

    before, begun = memory(), time.monotonic()
    signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, PATIENCE_S)
    says = io.StringIO()
    try:
        with contextlib.redirect_stdout(says), contextlib.redirect_stderr(says):
            code = run(list(case.arguments))
    except Accepted:
        code = 0
    except SystemExit as leaving:
        code = int(leaving.code or 0)
    except Hang:
        return "hang", ""
    except BaseException:
        return "traceback", traceback.format_exc(limit=-4)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
    if memory() - before > MOST_GB or time.monotonic() - begun > PATIENCE_S:
        return "too much", f"{time.monotonic() - begun:.0f} s, {memory() - before:.1f} GB more"
    if code not in (0, 2):
        return "exit code", f"{code}: {says.getvalue()[-300:]}"
    if code == 0:
        return ("accepted, though wrong", says.getvalue()[-300:]) if case.is_wrong else ("accepted", "")
    is_said = "error" in says.getvalue() or "helptext" in says.getvalue()  # ours, or the parser's
    return ("refused", "") if is_said else ("no message", says.getvalue()[-300:])


def memory() -> float:
    """The largest this process has been [GB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


def show(outcomes: Counter[tuple[str, str]], console: Console) -> None:
    """A row per kind of input, a column per outcome."""
    columns = sorted({outcome for _, outcome in outcomes})
    table = Table(title="what became of the inputs", title_justify="left")
    for column in ("", *columns):
        table.add_column(column, justify="right")
    for kind in sorted({kind for kind, _ in outcomes}):
        table.add_row(kind, *(str(outcomes[kind, outcome]) for outcome in columns))
    console.print(table)


if __name__ == "__main__":
    main()
