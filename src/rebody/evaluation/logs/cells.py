"""Numbers in the cells of a log: decimal notation and nothing else that Python would take for a number."""

import math
import re

_DECIMAL_POINT = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?")
_DECIMAL_COMMA = re.compile(_DECIMAL_POINT.pattern.replace(r"\.", ","))
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)


def number(cell: str, decimal_comma: bool = False) -> float:
    """Its value; NaN where it is not written as a decimal number, as in `1_0`, `0x1F` or `nan`."""
    if (_DECIMAL_COMMA if decimal_comma else _DECIMAL_POINT).fullmatch(cell):
        return float(cell.replace(",", "."))
    return math.nan


def is_not_finite(cell: str) -> bool:
    """Whether it says NaN or infinity, rather than something unreadable."""
    return _NOT_FINITE.fullmatch(cell) is not None
