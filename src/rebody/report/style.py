"""How figures look."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from rebody.store.files import written_whole

TRUTH, BELIEF, MOTION, ORACLE, IDLE = "#222222", "#d1495b", "#2b6f9e", "#8a8a8a", "#c9a227"
LOOK: dict[Any, Any] = {
    "axes.spines.top": False,
    "axes.spines.right": False,
    "font.size": 10,
    "legend.fontsize": 8,
    "legend.frameon": False,
}
TASKS = "coolwarm"
"""Colour map of targets: back is blue, front is red."""
SHADES = (1.0, 0.6, 0.4, 0.25)
"""Opacity of a vector's components, by turns."""
LETTERS = 44
"""Of a name that a user chose: more would not fit beside axes."""


def as_text(name: str) -> str:
    """A name that a user chose, for a figure: one line, without its middle if it is long, dollars no mathematics."""
    line = " ".join("".join(letter if letter.isprintable() else " " for letter in name).split())
    if len(line) > LETTERS:
        line = f"{line[: LETTERS // 2]}…{line[-LETTERS // 2 :]}"
    return line.replace("$", r"\$")


@contextmanager
def figure(
    path: Path, *shape: int, size: tuple[float, float], width_ratios: tuple[float, ...] | None = None
) -> Iterator[tuple[Figure, list]]:
    """A figure with a grid of axes, written to `path` at the end, whole or not at all.

    Axes with labelled lines get a legend, unless they have one.
    """
    with plt.rc_context(LOOK):
        drawing, axes = plt.subplots(
            *shape, figsize=size, layout="constrained", squeeze=False, width_ratios=width_ratios
        )
        try:
            yield drawing, list(axes.ravel())
            for each in drawing.axes:
                if each.get_legend() is None and each.get_legend_handles_labels()[0]:
                    each.legend()
            with written_whole(path) as unfinished, warnings.catch_warnings():
                warnings.filterwarnings("ignore", "Glyph .* missing from font")  # a browser has more
                drawing.savefig(unfinished, format=path.suffix[1:], dpi=120)
        finally:
            plt.close(drawing)
