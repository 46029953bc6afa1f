"""A picture of births and merges over laps: the mixture finds six clusters, one of them small, from one component.

.venv/bin/python benchmarks/mixture_picture.py [--out docs/mixture.png]
"""

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Ellipse

from rebody.inference.mixture import DirichletProcessMixture
from rebody.report.style import BELIEF, MOTION, figure

SHOWN = 4
"""Laps that are drawn."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("docs/mixture.png"))
    points = clusters(np.random.default_rng(0))
    mixture = DirichletProcessMixture().fit(points)
    laps = mixture.history_
    with figure(parser.parse_args().out, 1, SHOWN + 1, size=(16.0, 3.6)) as (_, panels):
        chosen = [0, 1, 2, len(laps) - 1][:SHOWN]
        for axes, lap in zip(panels, chosen, strict=False):
            axes.plot(*points.T, ".", color="#b9c3cc", ms=2)
            draw(axes, mixture, laps[lap])
            moves = f"{laps[lap].births} split, {laps[lap].merges} merged, {laps[lap].deletes} deleted"
            axes.set(title=f"lap {lap + 1}: {laps[lap].components} components\n{moves}", aspect="equal")
        panels[-1].plot(np.arange(1, len(laps) + 1), [lap.bound for lap in laps], "o-", color=MOTION)
        panels[-1].set(xlabel="lap", ylabel="ELBO [nats]", title=f"{len(points)} points")


def clusters(rng: np.random.Generator) -> np.ndarray:
    """Five clusters of 400 points and one of 25."""
    places = [(-4, -4), (-4, 4), (4, -4), (4, 4), (0, 0), (0, 6)]
    parts = []
    for place, size in zip(places, [400] * 5 + [25], strict=True):
        slant = rng.uniform(-0.8, 0.8)
        covariance = 0.5 * np.array([[1.0, slant], [slant, 1.0]])
        parts.append(rng.multivariate_normal(place, covariance if size > 25 else 0.05 * np.eye(2), size))
    return np.concatenate(parts)


def draw(axes: plt.Axes, mixture: DirichletProcessMixture, lap) -> None:
    """Two standard deviations of each component."""
    model, _ = mixture.fitted
    components = lap.known.parameters.components
    for mean, covariance in zip(components.mean, model.gaussians.covariances(components), strict=True):
        values, vectors = np.linalg.eigh(covariance)
        angle = np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1]))
        axes.add_patch(Ellipse(mean, *4 * np.sqrt(values[::-1]), angle=angle, fill=False, color=BELIEF, lw=1.5))


if __name__ == "__main__":
    main()
