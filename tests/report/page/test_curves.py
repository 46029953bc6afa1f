"""Which columns of a log are drawn, and how."""

import re

import pytest

from rebody.report.page.curves import LEFT_OUT, PANELS, learning_curves
from rebody.store import load_artifact, shipped_artifacts
from rebody.training.run import read_log

KNOWN = [column for each in PANELS for column in each.columns]


def test_a_column_is_drawn_once():
    assert len(KNOWN) == len(set(KNOWN))
    assert not set(KNOWN) & set(LEFT_OUT)


@pytest.mark.parametrize("name", [name for name, _ in shipped_artifacts()])
def test_every_measurement_of_training_has_its_axes(name):
    assert read_log(load_artifact(name).log).keys() <= {*KNOWN, *LEFT_OUT}


def test_what_was_never_measured_is_not_drawn():
    log = read_log("iteration,kl,cross_entropy\n1,2.0,\n2,1.0,\n")
    assert list(learning_curves(log)) == ["belief against prior"]


def test_what_is_measured_seldom_has_dots():
    often = "iteration,kl\n" + "".join(f"{i},{i}\n" for i in range(1, 21))
    seldom = "iteration,kl\n" + "".join(f"{i},{i if i % 10 == 0 else ''}\n" for i in range(1, 21))
    drawn = [learning_curves(read_log(text))["belief against prior"] for text in (often, seldom)]
    assert [len(re.findall(r"<use [^>]*var\(--motion\)", svg)) for svg in drawn] == [0, 2 + 1]  # one in the legend
