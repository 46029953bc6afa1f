"""Every number of every settings class has a range, and what lies outside is refused by the name of its option."""

from dataclasses import dataclass, field, fields, is_dataclass, replace

import numpy as np
import pytest

from rebody.bodies import load_robot
from rebody.errors import RebodyError
from rebody.ranges import Box, Count, Layers, Share, _fields_of, _numbers, check_ranges, interval
from rebody.training.classifier import ClassifierConfig
from rebody.training.flat import FlatConfig
from rebody.training.high_level import HighLevelConfig
from rebody.training.inference import PRESETS
from rebody.training.scratch import ScratchConfig
from rebody.training.step_predictor import StepPredictorConfig
from rebody.training.tracker import tracker_preset

SETTINGS = {
    **PRESETS,
    **{robot: lambda robot=robot: tracker_preset(load_robot(robot)) for robot in ("cheetah", "hopper", "walker")},
    **{make.__name__: make for make in (ClassifierConfig, FlatConfig, HighLevelConfig, ScratchConfig)},
    "StepPredictorConfig": StepPredictorConfig,
}


@pytest.mark.parametrize("name", SETTINGS)
def test_every_number_has_a_range_and_lies_in_it(name):
    settings = SETTINGS[name]()
    check_ranges(settings)
    without = [
        option
        for option, value, annotation in _fields_of(settings, "")
        for number, limits in _numbers(value, annotation)
        if not limits
    ]
    assert without == []


@pytest.mark.parametrize("name", SETTINGS)
def test_no_number_may_be_nan_endless_or_far_below(name):
    """Of the settings themselves and of those within them."""
    settings = SETTINGS[name]()
    for spoilt, option in spoilt_copies(settings, ""):
        with pytest.raises(RebodyError, match=f"{option} must be"):
            check_ranges(spoilt)


def spoilt_copies(settings, prefix):
    for each in fields(settings):
        value = getattr(settings, each.name)
        option = f"{prefix}{each.name.replace('_', '-')}"
        if is_dataclass(value):
            for spoilt, inner in spoilt_copies(value, f"{option}."):
                yield spoiling(settings, each.name, spoilt), inner
        elif isinstance(value, int | float) and not isinstance(value, bool):
            for bad in (np.nan, np.inf, -1e7):
                yield spoiling(settings, each.name, bad), option


def spoiling(settings, name, value):
    """A copy that skips the checks of its class."""
    copy = object.__new__(type(settings))
    copy.__dict__.update(vars(settings) | {name: value})
    return copy


@dataclass(frozen=True)
class Inner:
    widths: tuple[Count, ...] = (8, 8)
    hidden: Layers = (8, 8)
    pair: tuple[Share, Share] | None = None


@dataclass(frozen=True)
class Outer:
    decay_rate: Share = 0.5
    length: Count | None = None
    inner: Inner = field(default_factory=Inner)


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        (Outer(decay_rate=1.5), r"^--decay-rate must be at least 0 and at most 1, not 1\.5\.$"),
        (Outer(decay_rate=float("nan")), r"^--decay-rate must be a number, not nan\.$"),
        (Outer(length=0), r"^--length must be at least 1 and at most 1,000,000, not 0\.$"),
        (Outer(inner=Inner(widths=(8, 0))), r"^--inner\.widths must be at least 1"),
        (Outer(inner=Inner(hidden=(1,) * 33)), r"^--inner\.hidden must be at most 32 numbers, not 33\.$"),
        (Outer(inner=Inner(pair=(0.5, 2.0))), r"^--inner\.pair must be"),
    ],
)
def test_messages_name_the_option_its_range_and_the_value(settings, says):
    check_ranges(Outer())
    check_ranges(replace(Outer(), length=3, inner=Inner(pair=(0.0, 1.0))))
    with pytest.raises(RebodyError, match=says):
        check_ranges(settings)


def test_a_box_has_a_smallest_and_a_largest_of_each_number():
    box = Box((-3.0, 1.0), (2.0, 4.0))
    assert (box.size, box.largest) == (2, (3.0, 4.0))
    assert interval(-1.0, 2.0) == Box((-1.0,), (2.0,))
    assert interval(2.0, 2.0).largest == (2.0,)


@pytest.mark.parametrize(
    ("low", "high", "says"),
    [
        ((), (), "low and high must be as many numbers each, at least one"),
        ((1.0,), (1.0, 2.0), "low and high must be as many numbers each"),
        ((1.0, 2.0), (3.0, 1.0), r"from \[1.0, 2.0\] to \[3.0, 1.0\] there is nothing"),
        ((float("nan"),), (1.0,), "there is nothing"),
    ],
)
def test_a_box_that_holds_nothing_is_refused(low, high, says):
    with pytest.raises(ValueError, match=says):
        Box(low, high)


@dataclass(frozen=True)
class Boxed:
    box: Box = field(default_factory=lambda: interval(-1.0, 1.0))
    boxes: tuple[Box, ...] = ()


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        (Boxed(box=Box((-1.0, -2e6), (1.0, 1.0))), r"^--box\.low must be at least -1e\+06"),
        (Boxed(box=interval(1.0, np.inf)), r"^--box\.high must be at least -1e\+06"),
        (Boxed(boxes=(interval(0.0, 1.0), interval(0.0, 2e6))), r"^--boxes\.1\.high must be"),
    ],
)
def test_ends_of_boxes_have_ranges(settings, says):
    check_ranges(Boxed(boxes=(interval(0.0, 1.0),)))
    with pytest.raises(RebodyError, match=says):
        check_ranges(settings)
