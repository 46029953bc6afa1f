"""Figures and videos of evaluations."""

from rebody.report.belief import plot_beliefs
from rebody.report.figures import plot_episode, plot_transfer
from rebody.report.video import film

__all__ = ["film", "plot_beliefs", "plot_episode", "plot_transfer"]
