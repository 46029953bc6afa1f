"""Ranges of settings: declared beside each field, checked once, before any work.

A field's annotation says what it may be, `robots: Count = 64`; `check_ranges` holds a whole tree of settings against
it. Upper ends are far beyond what makes sense: they keep slips of the finger from running for years.
"""

import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

from msgspec import Meta

from rebody.errors import RebodyError

Count = Annotated[int, Meta(ge=1, le=1_000_000)]
"""How many of something there are or are done."""
Updates = Annotated[int, Meta(ge=1, le=100_000_000)]
"""Steps of an optimiser over a whole run."""
Decisions = Annotated[int, Meta(ge=1, le=36_000)]
"""Decisions of an episode or of a window: an hour at most."""
Number = Annotated[int, Meta(ge=0, le=1_000_000)]
"""The same, where 0 means none."""
Copies = Annotated[int, Meta(ge=1, le=4096)]
"""Bodies that move in parallel, and units of a layer."""
Layers = Annotated[tuple[Copies, ...], Meta(max_length=32)]
"""Units of each hidden layer of a network."""
Rows = Annotated[int, Meta(ge=1, le=5_000_000)]
"""Transitions that are kept in memory."""
Share = Annotated[float, Meta(ge=0, le=1)]
"""A part of a whole, or a probability."""
Positive = Annotated[float, Meta(gt=0, le=1e6)]
"""A finite size."""
NotNegative = Annotated[float, Meta(ge=0, le=1e6)]
"""A finite size or weight, 0 for none."""
Finite = Annotated[float, Meta(ge=-1e6, le=1e6)]
"""A finite number of either sign."""
Rate = Annotated[float, Meta(gt=0, le=1)]
"""A step size, or how much of something new is taken over at a time."""
Seconds = Annotated[float, Meta(ge=0.1, le=3600)]
"""Simulated time of an episode [s]."""
Seeds = Annotated[int, Meta(ge=1, le=1000)]
"""Evaluation seeds of every task."""
Episodes = Annotated[int, Meta(ge=1, le=10_000)]
"""Episodes at once."""
Port = Annotated[int, Meta(ge=0, le=65_535)]
"""0 for any that is free."""
Seed = Annotated[int, Meta(ge=0, lt=2**32)]
"""Random numbers know 32 bits of it: two that differ by 2^32 would be the same."""


@dataclass(frozen=True)
class Box:
    """A range of vectors: the smallest and the largest of each number; ValueError where there is none between."""

    low: tuple[Finite, ...]
    high: tuple[Finite, ...]

    polar: bool = False
    """Whether its two numbers are a vector's length and its bearing [rad], so that it is a ring or a sector of one."""

    def __post_init__(self):
        """ValueError for ends that are none."""
        if not self.low or len(self.low) != len(self.high):
            raise ValueError("low and high must be as many numbers each, at least one")
        if self.polar and (self.size != 2 or self.low[0] < 0):
            raise ValueError("a polar one has two numbers, a length that is not negative and a bearing")
        if not all(low <= high for low, high in zip(self.low, self.high, strict=True)):
            raise ValueError(f"from {list(self.low)} to {list(self.high)} there is nothing")

    @property
    def size(self) -> int:
        """How many numbers a vector has."""
        return len(self.low)

    @property
    def around(self) -> "Box":
        """Itself, or the square around a ring."""
        outer = self.high[0]
        return Box((-outer, -outer), (outer, outer)) if self.polar else self

    @property
    def largest(self) -> tuple[float, ...]:
        """The largest |number| of each axis."""
        if self.polar:
            return self.around.largest
        return tuple(max(abs(low), abs(high)) for low, high in zip(self.low, self.high, strict=True))


def interval(low: float, high: float) -> Box:
    """A box of one axis."""
    return Box((low,), (high,))


def check_ranges(settings: Any) -> None:
    """RebodyError that names the first field, as an option, whose value lies outside of its range or is NaN."""
    for option, value, annotation in _fields_of(settings, ""):
        if isinstance(value, tuple) and len(value) > (most := _most(annotation)):
            raise RebodyError(f"{option} must be at most {most} numbers, not {len(value)}.")
        for number, limits in _numbers(value, annotation):
            if wanted := _wanted(number, limits):
                raise RebodyError(f"{option} must be {wanted}, not {number!r}.")


def check_seed(seed: Any) -> None:
    """RebodyError where a seed is no whole number of 32 bits."""
    if not isinstance(seed, int) or isinstance(seed, bool) or not 0 <= seed < 2**32:
        raise RebodyError(f"a seed must be a whole number of at least 0 and less than {2**32:,}, not {seed!r}.")


def _fields_of(settings: Any, prefix: str) -> Iterator[tuple[str, Any, Any]]:
    """(option, value, annotation) of every field, those of settings within settings too."""
    annotations = get_type_hints(type(settings), include_extras=True)
    for field in fields(settings):
        value, annotation = getattr(settings, field.name), annotations[field.name]
        # a command holds its settings without a prefix of their own
        is_plain = any(getattr(extra, "name", None) == "" for extra in _extras(annotation))
        option = f"{prefix}{field.name.replace('_', '-')}"
        if is_dataclass(value):
            yield from _fields_of(value, prefix if is_plain else f"{option}.")
        elif isinstance(value, tuple) and all(map(is_dataclass, value)):
            for i, item in enumerate(value):
                yield from _fields_of(item, f"{option}.{i}.")
        else:
            yield f"--{option}", value, annotation


def _numbers(value: Any, annotation: Any) -> Iterator[tuple[float | int, list[Meta]]]:
    """Every number of a value beside the limits that its annotation sets."""
    alternatives = list(_alternatives(annotation))
    if isinstance(value, tuple):
        inner = next((get_args(bare) for bare, _ in alternatives if get_origin(bare) is tuple), ())
        of_each = inner[:1] * len(value) if inner[-1:] == (Ellipsis,) else inner
        for item, of_item in zip(value, of_each, strict=False):
            yield from _numbers(item, of_item)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield value, [limit for _, limits in alternatives for limit in limits]


def _alternatives(annotation: Any) -> Iterator[tuple[Any, list[Meta]]]:
    """The types that a value may have, each with its limits."""
    bare = get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation
    limits = [extra for extra in _extras(annotation) if isinstance(extra, Meta)]
    if get_origin(bare) in (Union, UnionType):
        for option in get_args(bare):
            for inner, of_inner in _alternatives(option):
                yield inner, limits + of_inner
    else:
        yield bare, limits


def _most(annotation: Any) -> int:
    """How many numbers there may be."""
    limits = [extra.max_length for extra in _extras(annotation) if isinstance(extra, Meta) and extra.max_length]
    return min(limits, default=sys.maxsize)


def _extras(annotation: Any) -> tuple[Any, ...]:
    return get_args(annotation)[1:] if get_origin(annotation) is Annotated else ()


def _wanted(number: float | int, limits: list[Meta]) -> str:
    """What a number should be, nothing where it is."""
    if math.isnan(number):
        return "a number"
    for limit in limits:
        is_low = (limit.ge is not None and number < limit.ge) or (limit.gt is not None and number <= limit.gt)
        is_high = (limit.le is not None and number > limit.le) or (limit.lt is not None and number >= limit.lt)
        if is_low or is_high:
            low = f"at least {limit.ge:g}" if limit.ge is not None else f"more than {limit.gt:g}"
            return f"{low} and {f'at most {limit.le:,}' if limit.le is not None else f'less than {limit.lt:,}'}"
    return ""
