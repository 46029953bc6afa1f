"""Payments by hand, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from tests.tasks.conftest import PLACE

from rebody.errors import RebodyError
from rebody.tasks import FamilySet, Payment
from rebody.tasks.line import GOAL, VELOCITY
from rebody.tasks.payment import FORMS, NAMED, read_payment
from rebody.types import global_state

ROOT = Path(__file__).parents[2]


def earned(payment, family, target, **fields):
    """Of one target in one state."""
    families = FamilySet((family,))
    state = global_state(**{name: np.asarray(value, float) for name, value in fields.items()})
    return float(families.reward(families.task(family.name, target), state, payment.law))


@pytest.mark.parametrize(
    ("form", "more", "goal", "place"),  # from x = 1 to 4; from (0, 0) to (3, -4)
    [
        ("distance", {}, -3.0, -5.0),
        ("l1", {}, -3.0, -7.0),
        ("squared", {}, -9.0, -25.0),
        ("power", {"exponent": 1.5}, -(3.0**1.5), -(5.0**1.5)),
        ("gaussian", {"width": 2.0}, np.exp(-9 / 4), np.exp(-25 / 4)),
        ("clipped", {"width": 4.0}, -3.0, -4.0),
        ("sparse", {"width": 4.0}, 1.0, 0.0),
        ("direction", {}, 1.0, 0.0),
    ],
)
def test_each_form_by_hand(form, more, goal, place):
    plain, scaled = Payment(form, **more), Payment(form, scale=2.0, offset=0.5, **more)
    assert earned(plain, GOAL, 4.0, x=1.0) == pytest.approx(goal, rel=1e-5)
    assert earned(plain, PLACE, (3.0, -4.0), x=0.0, y=0.0) == pytest.approx(place, rel=1e-5, abs=1e-6)
    assert earned(scaled, GOAL, 4.0, x=1.0) == pytest.approx(2 * goal + 0.5, rel=1e-5)


@pytest.mark.parametrize(
    ("payment", "family", "target", "state", "pays"),
    [
        (Payment(relative=True), GOAL, 4.0, {"x": 1.0}, -0.75),
        (Payment(relative=True), GOAL, 0.5, {"x": 0.0}, -0.5),  # divided by the floor of 1 m
        (Payment("squared", relative=True), PLACE, (3.0, -4.0), {"x": 0.0, "y": 0.0}, -1.0),
        (Payment("gaussian", relative=True, width=0.5), GOAL, -4.0, {"x": -2.0}, np.exp(-1.0)),
        (Payment("direction"), VELOCITY, -2.0, {"vx": -1.5}, 1.5),
        (Payment("direction"), PLACE, (3.0, -4.0), {"x": 3.0, "y": -4.0}, 5.0),
        (Payment("direction"), PLACE, (3.0, -4.0), {"x": 4.0, "y": 3.0}, 0.0),
    ],
)
def test_sizes_of_the_target_and_its_direction(payment, family, target, state, pays):
    assert earned(payment, family, target, **state) == pytest.approx(pays, rel=1e-5, abs=1e-6)


def test_an_action_costs_its_mean_square():
    actions = np.array([[[1.0, -1.0], [0.5, 0.0]], [[0.0, 0.0], [0.5, 0.0]]])
    np.testing.assert_allclose(Payment(control_cost=0.4).cost(actions), [[0.4, 0.05], [0.0, 0.05]])


def test_a_file_is_the_dataclass(tmp_path):
    path = tmp_path / "law.toml"
    path.write_text('form = "power"\nexponent = 1.5\nscale = 2\ndelay_s = 0.3\n')
    assert read_payment(str(path)) == Payment("power", exponent=1.5, scale=2.0, delay_s=0.3)
    assert read_payment(str(path)).delay == 3
    assert read_payment("gaussian") == Payment("gaussian")
    assert read_payment("relative") == Payment(relative=True)
    assert read_payment(None) is None


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('form = "gausian"', "'gausian' is unknown; there are distance, l1"),
        ("width = 0.0", "width"),
        ("scale = -1.0", "scale"),
        ("scale = nan", "scale"),
        ("delay_s = 0.05", "0.05 is no multiple of a decision of 0.1 s"),
        ("delay_s = 0.4", "delay_s"),
        ("dropped = 1.5", "dropped"),
        ("exponent = 9.0", "exponent"),
        ("bonus = 1.0", "bonus: it is unknown"),
        ("form = ", "is not a TOML file"),
    ],
)
def test_what_is_no_law_is_refused(text, says, tmp_path):
    path = tmp_path / "law.toml"
    path.write_text(text)
    with pytest.raises(RebodyError, match=says) as refused:
        read_payment(str(path))
    assert str(path) in str(refused.value)


@pytest.mark.parametrize(
    ("reference", "says"), [("gausian", "Did you mean 'gaussian'"), ("no/law.toml", "cannot read")]
)
def test_a_law_that_there_is_not(reference, says):
    with pytest.raises(RebodyError, match=says):
        read_payment(reference)


def test_in_short():
    assert Payment().in_short == "distance"
    assert Payment("gaussian", True, 3.0, 1.0, delay_s=0.3).in_short == (
        "gaussian, relative, scale 3, offset 1, delay_s 0.3"
    )


def test_the_page_says_what_there_is():
    page = (ROOT / "docs" / "reward-laws.md").read_text()
    for name, form in FORMS.items():
        formula = form.formula.replace("|", r"\|")
        assert f"| `{name}` | {formula} |" in page
    for field in Payment.__dataclass_fields__:
        assert f"\n{field} = " in page
    assert NAMED.keys() - FORMS.keys() == {"plain", "relative"}


@pytest.mark.parametrize("path", sorted((ROOT / "examples" / "laws").glob("*.toml")), ids=lambda path: path.stem)
def test_examples_are_laws(path):
    assert read_payment(str(path)) != Payment()
