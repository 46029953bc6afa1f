"""How far a run is: a bar on a terminal, now and then a line in a log file."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

LINE_EVERY_S = 30.0
LONG_S = 3600.0
"""What takes longer says so as soon as that is known."""
TIMED = 3
"""Iterations after which it is: the first of them compile."""

Metrics = dict[str, float]
Show = Callable[[int, Metrics], None]
"""Takes the iterations done and their metrics; those named `evaluation/...` are shown."""


@contextmanager
def progress(label: str, total: int, done: int) -> Iterator[Show]:
    """Show a run of `total` iterations of which `done` are behind it, with an estimate of what is left."""
    console, begun = Console(stderr=True, soft_wrap=True), time.monotonic()
    with _bar(label, total, done, console) if console.is_terminal else _lines(label, total, done, console) as show:

        def show_and_warn(iteration: int, metrics: Metrics) -> None:
            show(iteration, metrics)
            left = (time.monotonic() - begun) / (iteration - done) * (total - iteration)
            if iteration - done == TIMED and left > LONG_S:
                console.print(
                    f"{label}: this will take about {left / 3600:.1f} hours. Ctrl-C saves the run; the same command "
                    "with --resume goes on with it.",
                    highlight=False,
                )

        yield show_and_warn


@contextmanager
def _bar(label: str, total: int, done: int, console: Console) -> Iterator[Show]:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=30),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}"),
    )
    with Progress(*columns, console=console) as bar:
        task = bar.add_task(label, total=total, completed=done, note="")

        def show(iteration: int, metrics: Metrics) -> None:
            bar.update(task, completed=iteration)
            if note := _note(metrics):
                bar.update(task, note=note)

        yield show


@contextmanager
def _lines(label: str, total: int, done: int, console: Console) -> Iterator[Show]:
    begun = last_line = time.monotonic()

    def show(iteration: int, metrics: Metrics) -> None:
        nonlocal last_line
        note, now = _note(metrics), time.monotonic()
        if note or now - last_line > LINE_EVERY_S:
            last_line = now
            left = (now - begun) / (iteration - done) * (total - iteration)
            line = f"{label} {iteration}/{total}  {now - begun:.0f} s, about {left:.0f} s left  {note}"
            console.print(line.rstrip(), highlight=False, soft_wrap=True)

    yield show


def _note(metrics: Metrics) -> str:
    shown = {name.split("/")[1]: value for name, value in metrics.items() if name.startswith("evaluation/")}
    return "  ".join(f"{name} {value:.3g}" for name, value in shown.items())
