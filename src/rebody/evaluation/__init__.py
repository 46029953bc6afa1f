"""Agents judged on hidden tasks."""

from rebody.evaluation.evaluate import evaluate
from rebody.evaluation.reading import read_results
from rebody.evaluation.results import Results, save_results
from rebody.evaluation.tables import summary_table

__all__ = ["Results", "evaluate", "read_results", "save_results", "summary_table"]
