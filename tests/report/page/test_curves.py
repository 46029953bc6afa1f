"""Which columns of a log are drawn, and how."""

import re

import pytest

from rebody.report.page.curves import LEFT_OUT, learning_curves, panels_of
from rebody.store import load_artifact, shipped_artifacts
from rebody.training.run import read_log


def known(log=()):
    return [column for each in panels_of(log, {}) for column in each.columns]


def test_a_column_is_drawn_once():
    columns = known([f"evaluation/{name} {of}" for name in ("goal", "place") for of in ("median", "p95", "R2")])
    assert len(columns) == len(set(columns))
    assert not set(columns) & set(LEFT_OUT)


@pytest.mark.parametrize("name", [name for name, _ in shipped_artifacts()])
def test_every_measurement_of_training_has_its_axes(name):
    log = read_log(load_artifact(name).log)
    assert log.keys() <= {*known(log), *LEFT_OUT}


def test_families_of_a_users_own_are_drawn_in_their_unit():
    log = read_log("iteration,evaluation/lean median,evaluation/lean p95,evaluation/goal median\n1,2.0,3.0,4.0\n")
    settings = {"training": {"families": [{"name": "lean", "quantity": {"unit": "m, rad"}}, "odd", None]}}
    drawn = learning_curves(log, settings)
    assert list(drawn) == ["final error: lean", "final error: goal"]
    assert "error [m, rad]" in drawn["final error: lean"]
    assert "error [m]" in drawn["final error: goal"]  # as it ships
    assert "error [" not in learning_curves(log)["final error: lean"]


def test_what_was_never_measured_is_not_drawn():
    log = read_log("iteration,kl,cross_entropy\n1,2.0,\n2,1.0,\n")
    assert list(learning_curves(log)) == ["belief against prior"]


def test_what_is_measured_seldom_has_dots():
    often = "iteration,kl\n" + "".join(f"{i},{i}\n" for i in range(1, 21))
    seldom = "iteration,kl\n" + "".join(f"{i},{i if i % 10 == 0 else ''}\n" for i in range(1, 21))
    drawn = [learning_curves(read_log(text))["belief against prior"] for text in (often, seldom)]
    assert [len(re.findall(r"<use [^>]*var\(--motion\)", svg)) for svg in drawn] == [0, 2 + 1]  # one in the legend
