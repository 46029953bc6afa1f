"""What would explain rewards that no known task explains: a quantity of the library, a target and a law."""

import math
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from rebody.inference.decoder import Expert
from rebody.inference.fitting import Evidence, Fit, fit, share_explained
from rebody.inference.hypotheses import amounts_of
from rebody.inference.inputs import inputs_of
from rebody.inference.law import (
    CLIPPED,
    DISTANCE,
    GAUSSIAN,
    L1,
    LATEST,
    PARAMETERS,
    SQUARED,
    Kind,
    Late,
    Rewards,
    begun,
    prior_of,
)
from rebody.tasks import SHIPPED, Quantity
from rebody.types import ANGLES, GLOBAL_FIELDS, AnyArray, GlobalState

ROWS = 200
"""Rewards that are looked at, evenly over time; the same for all, so that little is compiled."""
FEWEST = 10
"""Rewards that a proposal needs."""
STEPS, STARTS, BEYOND = 40, 16, 2.0
"""Of each fit; places that fits begin from, and how far these reach from the middle of the data, in half spans."""
HELD = 0.01
"""Standard deviation of an exponent, which is what its kind says."""
NO_BONUS = 5e-3
"""An offset that is so small a share of the scale is not told."""
STILL = 1e-6
"""What spans no more than this was not moved [m, rad, m/s]."""
KINDS = {"distance": DISTANCE, "squared": SQUARED, "gaussian": GAUSSIAN, "clipped": CLIPPED, "l1": L1}
"""By the names that laws have everywhere."""
WORDS = {
    "distance": "distance",
    "squared": "squared distance",
    "gaussian": "Gaussian",
    "clipped": "clipped distance",
    "l1": "summed distances",
}
OTHERS = {
    "y": ("m", "position y"),
    "z": ("m", "height"),
    "roll": ("rad", "roll"),
    "vy": ("m/s", "velocity y"),
    "roll_rate": ("rad/s", "roll rate"),
    "pitch_rate": ("rad/s", "pitch rate"),
    "yaw_rate": ("rad/s", "turn rate"),
}
"""Fields that no shipped family is about alone."""


def _library() -> tuple[Quantity, ...]:
    shipped = {family.quantity.components: family.quantity for family in SHIPPED}
    alone = [shipped.get((field,)) or Quantity(field, (field,), *OTHERS[field]) for field in GLOBAL_FIELDS]
    return (*alone, *(quantity for quantity in shipped.values() if quantity.size > 1))


LIBRARY = _library()
"""Every field of the global state alone, and the quantities of several that shipped families are about."""


@dataclass(frozen=True)
class Proposal:
    """A task and a law that would explain rewards."""

    quantity: Quantity
    target: tuple[float, ...]
    """In the unit of the quantity."""
    kind: str
    """Of `KINDS`."""
    scale: float
    """What is paid for a unit of what the kind measures."""
    offset: float
    """What is paid besides, at every moment."""
    width: float | None
    """Of a Gaussian, or where a distance is clipped, in the quantity's unit; None for others."""
    explained: float
    """Share of the rewards' variance, in [0, 1]."""
    cost: float
    """Minus the logarithm of the evidence [nats]; among proposals for the same rewards alone."""

    def __str__(self) -> str:
        unit = self.quantity.unit
        target = ", ".join(f"{number:.2f}" for number in self.target)
        width = "" if self.width is None else f" of width {self.width:.2g} {unit}"
        sign, is_none = "plus" if self.offset > 0 else "minus", abs(self.offset) < NO_BONUS * self.scale
        bonus = "" if is_none else f", {sign} {abs(self.offset):.3g}"
        return (
            f"{self.quantity.label} ({self.quantity.name}), target {target} {unit}, {WORDS[self.kind]}{width} times "
            f"{self.scale:.3g}{bonus}; explains {100 * self.explained:.1f} %"
        )


def propose(states: GlobalState, rewards: Float[np.ndarray, " time"]) -> list[Proposal]:
    """What would explain rewards, each paid in the state beside it [time] or up to 0.3 s before; the likeliest first.

    For each quantity that moved the likeliest law alone. A reward that is NaN was not heard. None where there are too
    few, or all are the same.
    """
    heard = np.flatnonzero(np.isfinite(rewards))
    if len(heard) < FEWEST or np.ptp(rewards[heard]) == 0:
        return []
    rows = heard[np.linspace(0, len(heard) - 1, min(ROWS, len(heard))).round().astype(int)]
    found = (_best(quantity, np.asarray(quantity.read(states), float), rewards, rows) for quantity in LIBRARY)
    return sorted((each for each in found if each is not None), key=lambda each: each.cost)


def _best(
    quantity: Quantity, values: Float[np.ndarray, "time size"], rewards: Float[np.ndarray, " time"], rows: np.ndarray
) -> Proposal | None:
    """The likeliest law of one quantity; None where that, or a part of it, never moved."""
    if np.min(np.ptp(values, axis=0)) <= STILL:
        return None
    is_angle = quantity.components[0] in ANGLES
    middle = np.zeros(quantity.size) if is_angle else (values.max(axis=0) + values.min(axis=0)) / 2
    half = 1.0 if is_angle else float(np.ptp(values, axis=0).max()) / 2
    names = [name for name in KINDS if quantity.size > 1 or name != "l1"]  # of one number all norms are the same
    kinds = Kind(*(jnp.asarray(column, jnp.float32) for column in zip(*(KINDS[name] for name in names), strict=True)))
    kinds = kinds._replace(exponent_std=jnp.full(len(names), HELD))
    expert = _identity(("yaw",) if is_angle else ("x", "y")[: quantity.size])
    evidence = _evidence(expert, (values - middle) / half, rewards, rows)
    fits = jax.tree.map(np.asarray, _fits(expert, evidence, kinds, _starts(quantity.size, is_angle)))
    which, start = np.unravel_index(np.argmin(fits.cost), fits.cost.shape)
    parameters = fits.parameters[which, start]
    name, place = names[which], np.asarray(expert.place(jnp.asarray(parameters[PARAMETERS:])))
    scale, offset, width = _in_units(name, parameters, half)
    noise, variance = np.asarray(fits.noise[which, start]), np.asarray(evidence.spread**2)
    explained = share_explained(noise, variance, np.asarray(len(rows)), PARAMETERS + quantity.size)
    return Proposal(
        quantity=quantity,
        target=tuple((middle + half * place).tolist()),
        kind=name,
        scale=scale,
        offset=offset,
        width=width,
        explained=float(explained),
        cost=float(fits.cost[which, start]),
    )


def _identity(fields: tuple[str, ...]) -> Expert:
    """An expert whose amounts are the place itself; of an angle, a vector that points there."""
    size = inputs_of(fields)
    keys = jax.random.split(jax.random.key(0))
    expert = Expert(fields, (1.0,) * len(fields), size, 1, True, hears_any_law=True, keys=keys)
    return eqx.tree_at(lambda e: e.reference.weights[0], expert, jnp.eye(size))


def _evidence(
    expert: Expert, values: Float[np.ndarray, "time size"], rewards: Float[np.ndarray, " time"], rows: np.ndarray
) -> Evidence:
    """These rows, with empty ones behind."""
    late = np.maximum(rows[:, None] - np.arange(LATEST + 1), 0)  # before the first state it was there all the time
    empty = ROWS - len(rows)
    states = np.pad(values[late], ((0, empty), (0, 0), (0, 0)), mode="edge").astype(np.float32)
    paid = np.pad(rewards[rows], (0, empty), mode="edge").astype(np.float32)
    weights = (np.arange(ROWS) < len(rows)).astype(np.float32)
    return Evidence(Late.of(expert, jnp.asarray(states)), paid, weights, np.asarray(np.std(rewards[rows]), np.float32))


def _starts(size: int, is_angle: bool) -> Float[np.ndarray, "start size"]:
    """Places in half spans: along a line, around a circle, or over a square."""
    if is_angle:
        return np.linspace(-np.pi, np.pi, STARTS, endpoint=False, dtype=np.float32)[:, None]
    ends = np.linspace(-BEYOND, BEYOND, STARTS if size == 1 else round(STARTS**0.5), dtype=np.float32)
    return np.stack(np.meshgrid(*[ends] * size), axis=-1).reshape(-1, size)


@eqx.filter_jit
def _fits(expert: Expert, evidence: Evidence, kinds: Kind, starts: Float[AnyArray, "start size"]) -> Fit:
    """Of each kind from each start, [kind, start]."""
    paid = evidence.rewards  # those behind the rows repeat the last
    likely = Rewards(jnp.min(paid), jnp.max(paid), jnp.asarray(evidence.spread))

    def fitted(kind, place):
        amounts = amounts_of(expert, place)
        start = begun(expert, evidence.states, paid, evidence.weights, kind, amounts, likely.spread)
        return fit(expert, evidence, kind, prior_of(expert, len(amounts), kind, likely), start, STEPS)

    return jax.vmap(lambda kind: jax.vmap(lambda place: fitted(kind, place))(starts))(kinds)


def _in_units(name: str, parameters: Float[np.ndarray, " parameter"], half: float) -> tuple[float, float, float | None]:
    """Scale, offset and width of a law whose distances are in half spans, in the unit of the quantity."""
    offset, log_scale, exponent, log_width, _ = map(float, parameters[:PARAMETERS])
    scale, width = math.exp(log_scale), math.exp(log_width)
    if name == "gaussian":  # fitted as what is lost against its top, so that a distance of 1 costs the scale
        height = scale / -math.expm1(-(width**-exponent))
        return height, offset - height, half * width
    return scale / half**exponent, offset, half * width if name == "clipped" else None
