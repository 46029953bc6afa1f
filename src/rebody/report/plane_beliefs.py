"""Pictures of what is believed in the plane, beside the truth: places, headings, and one belief being sharpened."""

from collections.abc import Sequence

import matplotlib.pyplot as plt
import numpy as np
from jaxtyping import Bool, Float
from matplotlib.axes import Axes
from matplotlib.image import AxesImage

from rebody.agents.belief import Reading
from rebody.report.ellipse import STDS
from rebody.report.plane import AT, ellipse_of
from rebody.report.style import BELIEF, MOTION, TRUTH
from rebody.types import DECISION_DT

EDGE_M = 20.0
"""Largest coordinate that is shown beside its true one; what is beyond lies at the edge."""
LARGEST_M = 6.0
"""Of an ellipse that a map has room for: how far it reaches."""
RIGHT, OTHER = {"color": BELIEF, "ms": 3, "alpha": 0.7}, {"color": "0.45", "ms": 4, "mfc": "none", "mew": 0.8}
TRUE_R, BELIEVED_R = 1.0, 0.62
"""Radii of the circles of true and of believed headings."""
FAINTEST, DARKEST = 12.0, -3.0
"""Standard deviations that the rewards lie off, from which on a map is white; and where it would be black."""


def draw_path(
    axes: Axes,
    path: Float[np.ndarray, "time 2"],
    readings: Sequence[Reading],
    target: Float[np.ndarray, " 2"],
    family: str,
) -> None:
    """From above: a path from the origin to a hidden place [m], where the body was at some moments, and in the same
    colour what was believed then, with two standard deviations; nothing where another family was believed in."""
    moments = [i for i in AT if i < len(path)]
    axes.plot(*np.concatenate([np.zeros((1, 2)), path]).T, color="0.6", lw=1.5, zorder=1)
    shown = [np.zeros(2), target, *path]
    for i, colour in zip(moments, plt.get_cmap("plasma")(np.linspace(0, 0.9, len(moments))), strict=True):
        axes.plot(*path[i], "o", color=colour, ms=5, label=f"{DECISION_DT * (i + 1):g} s")
        if readings[i].family == family:
            axes.plot(*readings[i].target, "+", color=colour, ms=9, mew=2)
            axes.add_artist(ellipse_of(readings[i], colour))
            reach = STDS * np.sqrt(np.diag(readings[i].covariance))
            reach = reach if reach.max() < LARGEST_M else 0.0
            shown += [np.clip(np.array(readings[i].target) + side * reach, -EDGE_M, EDGE_M) for side in (-1, 1)]
    axes.plot(*target, "x", color=TRUTH, ms=10, mew=2, label="hidden place")
    low, high = np.min(shown, axis=0), np.max(shown, axis=0)
    half, middle = 0.6 * float((high - low).max()), (low + high) / 2
    axes.set(xlim=middle[0] + np.array([-half, half]), ylim=middle[1] + np.array([-half, half]), aspect="equal")
    axes.set(xlabel="x [m]", ylabel="y [m]")


def draw_against(
    axes: Axes,
    true: Float[np.ndarray, " episode"],
    believed: Float[np.ndarray, " episode"],
    is_right: Bool[np.ndarray, " episode"],
) -> None:
    """A coordinate [m] as it is and as it is believed; rings where another family is believed in."""
    ends = np.array([-EDGE_M, EDGE_M])
    shown = np.clip(believed, *ends)
    axes.plot(ends, ends, color="0.85", lw=1, zorder=0)
    axes.plot(true[~is_right], shown[~is_right], "o", **OTHER, label="another family is likelier")
    axes.plot(true[is_right], shown[is_right], "o", **RIGHT, mew=0, label="its family is the likeliest")
    margin = 1.05 * ends
    axes.set(xlim=margin, ylim=margin, aspect="equal", xticks=(-15, 0, 15), yticks=(-15, 0, 15))


def draw_headings(
    axes: Axes,
    true: Float[np.ndarray, " episode"],
    believed: Float[np.ndarray, " episode"],
    is_right: Bool[np.ndarray, " episode"],
) -> None:
    """True headings [rad] on the outer circle, believed ones on the inner; a line between is radial if both agree."""
    turn = np.linspace(0, 2 * np.pi, 120)
    for radius in (TRUE_R, BELIEVED_R):
        axes.plot(radius * np.cos(turn), radius * np.sin(turn), color="0.85", lw=1, zorder=0)
    outer, inner = _on_circle(TRUE_R, true), _on_circle(BELIEVED_R, believed)
    for of_true, of_believed in zip(outer, inner, strict=True):
        axes.plot(*np.stack([of_true, of_believed], axis=-1), color="0.7", lw=0.5, zorder=1)
    axes.plot(*outer.T, "o", color=TRUTH, ms=3, mew=0, label="true")
    axes.plot(*inner[~is_right].T, "o", **OTHER, label="believed, another family is likelier")
    axes.plot(*inner[is_right].T, "o", **RIGHT, mew=0, label="believed")
    for angle, name in ((0.0, "0"), (np.pi / 2, "π/2"), (np.pi, "π"), (-np.pi / 2, "-π/2")):
        axes.text(1.17 * np.cos(angle), 1.17 * np.sin(angle), name, ha="center", va="center", fontsize=8)
    axes.set(xlim=(-1.3, 1.3), ylim=(-1.3, 1.3), aspect="equal", xticks=[], yticks=[])
    axes.spines[:].set_visible(False)


def _on_circle(radius: float, angle: Float[np.ndarray, " episode"]) -> Float[np.ndarray, "episode 2"]:
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def draw_sharpening(
    axes: Axes,
    places: Float[np.ndarray, "row column 2"],
    nats: Float[np.ndarray, "row column"],
    path: Float[np.ndarray, "time 2"],
    steps: Float[np.ndarray, "step 2"],
    mirror: Float[np.ndarray, " 2"],
    target: Float[np.ndarray, " 2"],
) -> AxesImage:
    """How far the rewards lie from those of each place [m], in standard deviations; the encoder's guess, and where
    steps take it."""
    (left, low), (right, high) = places[0, 0], places[-1, -1]
    off = np.sqrt(2 * np.maximum(nats, 0.0))
    look = {"cmap": "gray", "vmin": DARKEST, "vmax": FAINTEST, "interpolation": "bilinear"}
    image = axes.imshow(off, extent=(left, right, low, high), origin="lower", **look)
    axes.plot(*path.T, color=MOTION, lw=2.5, label="the toy's path")
    axes.plot(*steps.T, "o-", color=BELIEF, lw=1.2, ms=4, label="Gauss-Newton steps")
    axes.plot(*steps[0], "s", color=BELIEF, ms=8, mec="white", label="encoder's guess")
    axes.plot(*mirror, "D", color="#c9a227", ms=8, mec="white", label="other hypothesis")
    axes.plot(*target, "x", color=TRUTH, ms=11, mew=2, label="true place")
    axes.set(xlabel="x [m]", ylabel="y [m]", xlim=(left, right), ylim=(low, high), aspect="equal")
    return image
