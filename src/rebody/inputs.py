"""What may come in from outside: numbers of a given shape, finite, and of a size that a body can have.

Agent, belief, environments, logs, task files and the live page all ask here, so that one rule holds at every door.
Errors name the value, the field and, where the caller says so, the decision.
"""

import math
from typing import Any

import numpy as np
from jaxtyping import Float

from rebody.errors import RebodyError

LARGEST = 1e6
"""No position [m], speed [m/s], angle [rad], reward or action is larger. Beyond about 1e19 squares overflow in float32,
and beyond a thousand kilometres float32 no longer tells centimetres; such a number is a sentinel or a fault."""


def number(value: Any, what: str, where: str = "") -> float:
    """A real number, finite and at most `LARGEST` either way; RebodyError that calls it `what`."""
    array = _real(value, what, where)
    if array.shape != ():
        raise RebodyError(f"{_at(where)}{what} has shape {array.shape}; give one number.")
    return float(_within(array, what, where))


def numbers(value: Any, shape: tuple[int, ...], what: str, where: str = "") -> Float[np.ndarray, "..."]:
    """A float64 array of exactly this shape under the same conditions; RebodyError that names the first bad entry."""
    array = _real(value, what, where)
    if array.shape != shape:
        raise RebodyError(f"{_at(where)}{what} has shape {array.shape}, not {shape}.")
    return _within(array, what, where)


def reward(value: Any, where: str = "") -> float | None:
    """A reward; None where nothing was heard, which is valid, unlike NaN."""
    return None if value is None else number(value, "the reward", where)


def bad_entries(value: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Which entries of an array of that shape could not come in: all of them where it is no such array at all."""
    try:
        array = _real(value, "", "")
    except RebodyError:
        return np.ones(shape, bool)
    return ~(np.abs(array) <= LARGEST) if array.shape == shape else np.ones(shape, bool)


def _real(value: Any, what: str, where: str) -> np.ndarray:
    """As float64, from numbers alone: no strings, booleans, None or complex numbers."""
    try:
        array = np.asarray(value)
    except ValueError:  # ragged
        array = np.asarray(None)
    if array.dtype.kind not in "iuf":
        raise RebodyError(f"{_at(where)}{what} is {_shown(value)}; give {'numbers' if array.shape else 'a number'}.")
    return array.astype(float)


def _within(array: np.ndarray, what: str, where: str) -> np.ndarray:
    faulty = np.argwhere(~(np.abs(array) <= LARGEST))
    if len(faulty):
        place = tuple(int(i) for i in faulty[0])
        entry = "".join(f"[{i}]" for i in place)
        bound = "" if math.isfinite(array[place]) else "finite "
        raise RebodyError(
            f"{_at(where)}{what}{entry} is {array[place]:g}; give a {bound}number of at most {LARGEST:g} either way."
        )
    return array


def _at(where: str) -> str:
    return f"{where}: " if where else ""


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
