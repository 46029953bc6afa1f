"""How figures look."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.figure import Figure

TRUTH, BELIEF, MOTION, ORACLE, IDLE = "#222222", "#d1495b", "#2b6f9e", "#8a8a8a", "#c9a227"
TASKS = "coolwarm"
"""Colour map of targets: back is blue, front is red."""


@contextmanager
def figure(path: Path, *shape: int, size: tuple[float, float]) -> Iterator[tuple[Figure, list]]:
    """A figure with a grid of axes, written to `path` at the end."""
    with plt.rc_context({"axes.spines.top": False, "axes.spines.right": False, "font.size": 10}):
        drawing, axes = plt.subplots(*shape, figsize=size, layout="constrained", squeeze=False)
        try:
            yield drawing, list(axes.ravel())
            path.parent.mkdir(parents=True, exist_ok=True)
            drawing.savefig(path, dpi=120)
        finally:
            plt.close(drawing)
