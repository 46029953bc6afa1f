"""The figures of the thesis' chapter 6, by number: from logs that ship, or anew."""

from rebody.report.thesis.catalogue import FIGURES, ThesisFigure, find_figures, make_figure

__all__ = ["FIGURES", "ThesisFigure", "find_figures", "make_figure"]
