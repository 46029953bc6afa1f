"""Runs that somebody logged: read, resampled to decisions, and what a frozen module believes over them."""

from rebody.evaluation.logs.belief import BeliefOverTime, believe, save_beliefs
from rebody.evaluation.logs.doubts import doubts
from rebody.evaluation.logs.file import COLUMNS, Log, read_log
from rebody.evaluation.logs.format import Delimiter, Format, TimeUnit
from rebody.evaluation.logs.origin import begun_at_zero
from rebody.evaluation.logs.proposals import proposals
from rebody.evaluation.logs.resample import Decisions, resample

__all__ = [
    "COLUMNS",
    "BeliefOverTime",
    "Decisions",
    "Delimiter",
    "Format",
    "Log",
    "TimeUnit",
    "begun_at_zero",
    "believe",
    "doubts",
    "proposals",
    "read_log",
    "resample",
    "save_beliefs",
]
