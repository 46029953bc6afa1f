"""`rebody robot check` measures a robot that walks already."""

import pytest
from tests.walking import CART_TOML, write_cart

from rebody.cli.main import run

pytest.importorskip("onnxruntime")
pytest.importorskip("onnx")


def test_check_measures_what_a_policy_makes_of_commands(tmp_path, capsys):
    assert run(["robot", "check", str(write_cart(tmp_path)), "--figure", str(tmp_path / "cart.png")]) == 0
    said = capsys.readouterr().out
    assert "it moves 2 joints and hears command 3" in said
    for part in (
        "forward [m/s]",
        "0 fell",
        "dead = [0.00, 0.00, 0.00]",
        "drift = [0.00, 0.00, 0.00]",
        "at_once = 3.0",
        "rate = inf",
        "rebody run",
    ):
        assert part in said
    assert (tmp_path / "cart.png").stat().st_size > 10_000


def test_a_figure_that_cannot_be_written_is_refused_at_once(tmp_path, capsys):
    assert run(["robot", "check", str(write_cart(tmp_path)), "--figure", str(tmp_path / "cart.txt")]) == 2
    assert "commanded" not in capsys.readouterr().out


def test_a_policy_that_does_not_fit_is_an_error(tmp_path, capsys):
    wrong = CART_TOML.replace('inputs = ["command"]', 'inputs = ["command", "gravity"]')
    assert run(["robot", "check", str(write_cart(tmp_path, wrong))]) == 2
    said = capsys.readouterr()
    assert "hears 3 numbers, the description says 6 (command 3, gravity 3)" in " ".join(said.out.split())
    assert "robot 'cart' is not ready: see policy." in said.err
