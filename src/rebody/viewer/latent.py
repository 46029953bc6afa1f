"""The picture of the latent: where the belief is, on the mixture's clusters."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from matplotlib.text import Text

from rebody.agents.belief import Reading
from rebody.inference.mixture.padded import MixturePrior
from rebody.report.ellipse import STDS, outline
from rebody.tasks import FamilySet
from rebody.viewer import colours

SHOWN = 50
"""Decisions that the belief's trail goes back."""
LATENT, PROJECTED = ("latent 1", "latent 2"), ("main direction 1", "main direction 2")
CLUSTER = "#8a8a8a"
SIZE, DPI = (3.3, 2.05), 200
"""Inches, and pixels per inch: twice what a panel shows, so that it is sharp on any screen."""


@dataclass(frozen=True)
class Plane:
    """A projection of latents to two dimensions."""

    origin: Float[np.ndarray, " latent"]
    directions: Float[np.ndarray, "latent 2"]

    def points(self, latents: Float[np.ndarray, "*batch latent"]) -> Float[np.ndarray, "*batch 2"]:
        """Where latents lie."""
        return (latents - self.origin) @ self.directions

    def covariance(self, covariance: Float[np.ndarray, "latent latent"]) -> Float[np.ndarray, "2 2"]:
        """What is left of a covariance."""
        return self.directions.T @ covariance @ self.directions


def plane_of(latent: int, mixture: MixturePrior | None) -> Plane:
    """The latent's first two numbers; where more are clustered, the plane in which the clusters lie apart."""
    origin, directions = np.zeros(latent), np.eye(latent, 2)
    if mixture is not None and mixture.mean.shape[1] > 2 and np.sum(mixture.active) > 2:
        means = np.asarray(mixture.mean, float)[np.asarray(mixture.active)]
        clustered = means.shape[1]
        origin[:clustered] = means.mean(axis=0)
        directions[:clustered] = np.linalg.svd(means - means.mean(axis=0))[2][:2].T
    return Plane(origin, directions)


def component(
    mixture: MixturePrior, k: int, latent: int
) -> tuple[Float[np.ndarray, " latent"], Float[np.ndarray, "latent latent"]]:
    """Mean and expected covariance of a component; numbers of the latent that are not clustered are left at 0."""
    clustered = mixture.mean.shape[1]
    mean, covariance = np.zeros(latent), np.zeros((latent, latent))
    root = np.asarray(mixture.root[k], float)
    mean[:clustered] = mixture.mean[k]
    covariance[:clustered, :clustered] = np.linalg.inv(root.T @ root) / float(mixture.spread[k])
    return mean, covariance


class LatentPicture:
    """Draws beliefs upon what does not change, which is drawn once."""

    def __init__(self, latent: int, mixture: MixturePrior | None, families: FamilySet):
        self._plane, self._known = plane_of(latent, mixture), families
        self._figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
        self._canvas = FigureCanvasAgg(self._figure)
        self._axes = self._figure.add_subplot()
        self._axes.margins(0.12)
        self._axes.tick_params(labelsize=6, length=2, width=0.5)
        self._axes.spines[:].set(linewidth=0.5, color="#bbbbbb")
        names = LATENT if np.array_equal(self._plane.directions, np.eye(latent, 2)) else PROJECTED
        for set_label, name in zip((self._axes.set_xlabel, self._axes.set_ylabel), names, strict=True):
            set_label(name, fontsize=7)
        self._clusters = {} if mixture is None else self._add_clusters(mixture)
        self._trail = self._axes.scatter([], [], linewidths=0, animated=True)
        self._belief = Ellipse((0.0, 0.0), 0.0, 0.0, fill=False, edgecolor=colours.BELIEVED, animated=True)
        self._axes.add_artist(self._belief)
        self._axes.update_datalim([(-1.0, -1.0), (1.0, 1.0)])
        self._draw_background()

    def draw(self, readings: Sequence[Reading]) -> UInt8[np.ndarray, "height width 3"]:
        """The last beliefs, the newest with its standard deviations; clusters shine by their responsibilities."""
        readings = readings[-SHOWN:]
        if not readings:
            return self._pixels()
        points = self._plane.points(np.array([reading.latent.mean for reading in readings]))
        self._make_room(points)
        self._canvas.restore_region(self._background)
        for k, share in readings[-1].responsibilities.items():
            self._draw_cluster(k, share)
        freshness = np.linspace(1.0, 0.1, len(readings))[::-1]  # the newest is in full colour
        families = [self._known.named(reading.family).colour for reading in readings]
        self._trail.set(offsets=points, sizes=4 + 20 * freshness**4, facecolors=[*map(to_rgba, families, freshness)])
        self._axes.draw_artist(self._trail)
        self._belief.set(**_outline(points[-1], self._plane.covariance(np.diag(readings[-1].latent.variance))))
        self._axes.draw_artist(self._belief)
        return self._pixels()

    def _add_clusters(self, mixture: MixturePrior) -> dict[int, tuple[Ellipse, Text]]:
        clusters = {}
        for k in np.flatnonzero(mixture.active).tolist():
            mean, covariance = component(mixture, k, len(self._plane.origin))
            mean, covariance = self._plane.points(mean), self._plane.covariance(covariance)
            outline = _outline(mean, covariance)
            ellipse = Ellipse(outline["center"], outline["width"], outline["height"], angle=outline["angle"])
            self._axes.add_patch(ellipse).set_animated(True)
            top = (mean[0], mean[1] + STDS * covariance[1, 1] ** 0.5)
            text = self._axes.annotate("", top, (0, 1), textcoords="offset points", ha="center", fontsize=6.5)
            text.set_animated(True)
            clusters[k] = (ellipse, text)
        return clusters

    def _draw_cluster(self, k: int, share: float) -> None:
        ellipse, text = self._clusters[k]
        ellipse.set(facecolor=to_rgba(CLUSTER, 0.08 + 0.3 * share), edgecolor=to_rgba(CLUSTER, 0.4 + 0.6 * share))
        text.set_text(f"cluster {k}: {100 * share:.0f} %")
        self._axes.draw_artist(ellipse)
        self._axes.draw_artist(text)

    def _make_room(self, points: Float[np.ndarray, "point 2"]) -> None:
        """Let the axes reach to all points."""
        before = self._axes.dataLim.frozen()
        self._axes.update_datalim(points)
        if not np.array_equal(before, self._axes.dataLim):
            self._draw_background()

    def _draw_background(self) -> None:
        self._axes.autoscale_view()
        self._canvas.draw()
        self._background = self._canvas.copy_from_bbox(self._figure.bbox)

    def _pixels(self) -> UInt8[np.ndarray, "height width 3"]:
        return np.array(self._canvas.buffer_rgba())[..., :3]


def _outline(mean: Float[np.ndarray, " 2"], covariance: Float[np.ndarray, "2 2"]) -> dict[str, Any]:
    """An ellipse's centre, width, height and angle [degrees]."""
    first, second, angle = outline(covariance)
    return {
        "center": tuple(mean),
        "width": 2 * first,
        "height": 2 * second,
        "angle": np.degrees(angle),
    }
