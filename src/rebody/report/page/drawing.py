"""Figures as inline SVG, in the colours and letters of the page."""

import hashlib
import re
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import matplotlib.pyplot as plt
from markupsafe import Markup
from matplotlib.axes import Axes

from rebody.report.style import BELIEF, IDLE, MOTION, ORACLE, TRUTH, figure

COLOURS = {TRUTH: "truth", BELIEF: "belief", MOTION: "motion", ORACLE: "oracle", IDLE: "idle"}
"""CSS variables that take the place of colours: they are lighter on a dark page."""
CURVES = (MOTION, BELIEF, IDLE, ORACLE, TRUTH)
"""Colours of lines that stand for nothing else."""
SIZE = (4.8, 3.4)
ON_PAGE: dict[Any, Any] = {
    "svg.fonttype": "none",  # letters stay letters
    "svg.hashsalt": "rebody",  # the same figure, the same ids
    "savefig.transparent": True,
    "axes.autolimit_mode": "round_numbers",  # a logarithmic axis ends at whole decades
    "axes.xmargin": 0.0,
    "axes.ymargin": 0.0,
    "axes.titlesize": 11,
    **{f"{part}.color": TRUTH for part in ("text", "xtick", "ytick")},
    **{f"axes.{part}color": TRUTH for part in ("edge", "label", "title")},
}


def panel(draw: Callable[[Axes], Any]) -> Markup:
    """One pair of axes."""

    def on_file(path: Path) -> None:
        with figure(path, 1, 1, size=SIZE) as (_, (axes,)):
            draw(axes)

    return inline(on_file)


def inline(draw: Callable[[Path], None]) -> Markup:
    """What `draw` writes to a file, as SVG to put into a page."""
    with TemporaryDirectory() as folder, plt.rc_context(ON_PAGE):
        path = Path(folder) / "figure.svg"
        draw(path)
        return Markup(_fit_for_page(path.read_text()))


def _fit_for_page(text: str) -> str:
    svg = text[text.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    own = hashlib.sha256(svg.encode()).hexdigest()[:8]  # figures of one page share a space of ids
    svg = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{own}-", svg)
    for colour, variable in COLOURS.items():
        svg = svg.replace(colour, f"var(--{variable})")
    return svg
