"""How people pay a task: a form of the distance, a scale, a bonus and costs, late, noisy and with gaps.

    form = "gaussian"
    relative = true
    width = 0.5
    scale = 3.0
    offset = 1.0
    delay_s = 0.3

as a TOML file, or the same as a `Payment` in Python. A new form is one entry in `FORMS`.
"""

import tomllib
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import jax.numpy as jnp
from jaxtyping import Float
from msgspec import Meta

from rebody.errors import RebodyError, unknown
from rebody.ranges import Finite, NotNegative, Positive, Share
from rebody.store.files import TEXT, read_file, reason
from rebody.store.typed import Misfit, typed
from rebody.tasks.laws import Measure, RewardLaw
from rebody.types import DECISION_DT, AnyArray

MOST_LATE_S = 0.3
"""A reward comes at most so late [s]: three decisions."""


@dataclass(frozen=True)
class Form:
    """What is paid for a distance, before scale and offset."""

    formula: str
    """In messages; w is the width, p the exponent."""
    pay: Callable[[Any, Any, Any], Any]
    """(distance, width, exponent) -> reward, of arrays that broadcast."""
    measure: Measure = "l2"


FORMS = {
    "distance": Form("-|e|", lambda e, width, exponent: -e),
    "l1": Form("-sum |e_i|", lambda e, width, exponent: -e, measure="l1"),
    "squared": Form("-|e|^2", lambda e, width, exponent: -(e**2)),
    "power": Form("-|e|^p", lambda e, width, exponent: -(e**exponent)),
    "gaussian": Form("exp(-|e|^2 / w^2)", lambda e, width, exponent: jnp.exp(-((e / width) ** 2))),
    "clipped": Form("-min(|e|, w)", lambda e, width, exponent: -jnp.minimum(e, width)),
    "sparse": Form("1 where |e| < w, else 0", lambda e, width, exponent: jnp.where(e < width, 1.0, 0.0)),
    "direction": Form("speed along the target", lambda e, width, exponent: -e, measure="along"),
}
"""By name."""


@dataclass(frozen=True)
class Payment:
    """How the tasks of all families are paid: (scale * form + offset - cost + noise), delayed and with gaps."""

    form: str = "distance"
    """One of `FORMS`."""
    relative: bool = False
    """Whether distances are told in sizes of the target, max(|target|, the family's floor), not in its unit."""
    scale: Positive = 1.0
    """What the form is multiplied by."""
    offset: Finite = 0.0
    """What is paid at every moment, such as an alive bonus."""
    width: Positive = 1.0
    """Of the forms that have one, in the quantity's unit, or in sizes of the target where that is `relative`."""
    exponent: Annotated[float, Meta(ge=0.25, le=4.0)] = 1.0
    """Of the form `power`."""
    control_cost: NotNegative = 0.0
    """Times the mean squared action of the joints: a price that is no part of the task. A robot that walks by a policy
    pays for what the policy says."""
    noise: NotNegative = 0.0
    """Standard deviation of what is heard around what is earned, in the reward's unit."""
    delay_s: Annotated[float, Meta(ge=0.0, le=MOST_LATE_S)] = 0.0
    """How much later than earned a reward is heard [s], in whole decisions."""
    dropped: Share = 0.0
    """Share of decisions in which no reward is heard."""

    def __post_init__(self):
        """ValueError for what there is not."""
        if self.form not in FORMS:
            raise ValueError(f"form: '{self.form}' is unknown; there are {', '.join(FORMS)}")
        if abs(self.delay_s / DECISION_DT - round(self.delay_s / DECISION_DT)) > 1e-6:
            raise ValueError(f"delay_s: {self.delay_s:g} is no multiple of a decision of {DECISION_DT} s")

    @property
    def in_short(self) -> str:
        """Form, and what else is not as it is by default."""
        _, *others = ((field.name, getattr(self, field.name), field.default) for field in fields(self))
        said = [name if value is True else f"{name} {value:g}" for name, value, default in others if value != default]
        return ", ".join([self.form, *said])

    @property
    def delay(self) -> int:
        """In decisions."""
        return round(self.delay_s / DECISION_DT)

    @property
    def has_gaps(self) -> bool:
        """Whether there are decisions in which nothing is heard."""
        return self.delay > 0 or self.dropped > 0

    @cached_property
    def law(self) -> RewardLaw:
        """What is earned in a state, without costs."""
        form = FORMS[self.form]

        def pay(distance: Any, size: Any) -> Any:
            far = distance / size if self.relative else distance
            return self.scale * form.pay(far, self.width, self.exponent) + self.offset

        formula = f"{self.scale:g} * ({form.formula}) + {self.offset:g}"
        return RewardLaw(self.form, formula, pay, measure=form.measure)

    def cost(self, action: Float[AnyArray, "*batch joint"]) -> Float[AnyArray, "*batch"]:
        """What an action in [-1, 1] costs."""
        return self.control_cost * (action**2).mean(axis=-1)


NAMED = {
    "plain": Payment(),
    "relative": Payment(relative=True),
    **{name: Payment(form=name) for name in FORMS},
}
"""What a name alone means on a command line."""


def read_payment(reference: str | None) -> Payment | None:
    """A name, or the path of a TOML file; RebodyError that says what is wrong. None for the family's own law."""
    if reference is None or reference in NAMED:
        return None if reference is None else NAMED[reference]
    path = Path(reference)
    if path.suffix != ".toml":
        raise unknown("law", reference, NAMED, "the path of a TOML file")
    try:
        return typed(tomllib.loads(read_file(path, TEXT).decode("utf-8-sig")), Payment)
    except OSError as error:
        raise RebodyError(f"cannot read the law's file '{path}': {reason(error)}.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise RebodyError(f"'{path}' is not a TOML file: {error}. See docs/reward-laws.md.") from error
    except Misfit as misfit:
        raise RebodyError(f"'{path}' does not describe a reward law ({misfit}). See docs/reward-laws.md.") from misfit
