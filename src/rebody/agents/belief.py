"""A frozen module's belief about one task, told of it from outside: state and reward in, reading out."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, SupportsFloat

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from rebody.bodies.robot import wrap_angle
from rebody.errors import RebodyError
from rebody.inference import Encoder, EncoderCarry
from rebody.inference.mixture.padded import MixturePrior
from rebody.inference.probe import Probe
from rebody.tasks import FAMILIES
from rebody.types import DECISION_DT, GLOBAL_FIELDS, RATE_OF, AnyArray, Belief, GlobalState, Transition


@dataclass(frozen=True)
class Reading:
    """What is believed after a decision."""

    family: str
    """The likeliest."""
    target: float
    """In the family's unit (m, m/s, rad)."""
    base_tasks: dict[tuple[str, int], float]
    """Probability of each base task that the module knows: a family, and 1 or -1 for its target's sign."""
    responsibilities: dict[int, float]
    """Of each of the mixture's clusters; empty where there is no mixture."""
    latent: Belief
    """Mean and variance; shapes [latent]."""

    @property
    def probabilities(self) -> dict[str, float]:
        """Of each family."""
        families = dict.fromkeys(family for family, _ in self.base_tasks)
        return {family: sum(self.base_tasks[family, sign] for sign in (1, -1)) for family in families}


class LiveBelief:
    """Takes in a decision at a time; `rebody.load_inference(name).begin(state)` makes one."""

    def __init__(self, encoder: Encoder, probe: Probe, mixture: MixturePrior | None, state: Mapping[str, Any]):
        self._encoder, self._probe, self._mixture = encoder, probe, mixture
        self._memory, self._previous = encoder.initial(), _global_state(encoder.fields, state, None)
        self._reading = self._read(encoder.prior())

    @property
    def reading(self) -> Reading:
        """What is believed now; before the first update that of a belief that knows nothing."""
        return self._reading

    def update(self, state: Mapping[str, Any], reward: SupportsFloat) -> Reading:
        """Take in a decision: the state 0.1 s after the last one, and the reward in between; what is believed now.

        `state` holds the fields that the module sees (m, rad, m/s, rad/s; others are not looked at). A velocity that
        is left out is the displacement over the decision. RebodyError where a field is missing or no finite number,
        or the reward is one that no task gives: rewards are never positive.
        """
        heard = float(reward)
        if not math.isfinite(heard) or heard > 0:
            raise RebodyError(f"the reward {heard:g} cannot be: it is -|error|, never above 0.")
        now = _global_state(self._encoder.fields, state, self._previous)
        transition = Transition(self._previous, np.asarray(heard, np.float32), now)
        self._memory, belief = _take_in(self._encoder, self._memory, transition)
        self._previous, self._reading = now, self._read(belief)
        return self._reading

    def _read(self, belief: Belief) -> Reading:
        read = jax.tree.map(np.asarray, _read(self._probe, self._mixture, belief))
        family, target, probabilities, front, shares = read
        names = [FAMILIES[i].name for i in np.asarray(self._probe.families)]
        clusters = [] if self._mixture is None else np.flatnonzero(self._mixture.active)
        return Reading(
            family=FAMILIES[int(family)].name,
            target=float(target),
            base_tasks={
                (name, sign): float(share * (ahead if sign > 0 else 1 - ahead))
                for name, share, ahead in zip(names, probabilities, front, strict=True)
                for sign in (1, -1)
            },
            responsibilities={int(k): float(shares[k]) for k in clusters},
            latent=jax.tree.map(np.asarray, belief),
        )


def _global_state(fields: tuple[str, ...], given: Mapping[str, Any], previous: GlobalState | None) -> GlobalState:
    """What an encoder that sees these fields is shown."""
    known = {field: float(given[field]) for field in GLOBAL_FIELDS if field in given}
    for field in fields:
        if field not in known:
            known[field] = _velocity(field, known, previous)
    if faulty := [field for field in fields if not math.isfinite(known[field])]:
        raise RebodyError(f"the state's '{faulty[0]}' is {known[faulty[0]]}; give a finite number.")
    if "pitch" in known:
        known["pitch"] = _wrapped(known["pitch"])
    return GlobalState(**{field: np.asarray(known.get(field, 0.0), np.float32) for field in GLOBAL_FIELDS})


def _velocity(field: str, known: Mapping[str, float], previous: GlobalState | None) -> float:
    """The displacement since the last decision over its time; nothing moved before the first."""
    position = RATE_OF.get(field)
    if position is None or position not in known:
        raise RebodyError(f"the state lacks '{field}': give {field}" + (f", or {position}." if position else "."))
    if previous is None:
        return 0.0
    moved = known[position] - float(getattr(previous, position))
    return (_wrapped(moved) if position == "pitch" else moved) / DECISION_DT


def _wrapped(angle: float) -> float:
    return float(wrap_angle(np.asarray(angle)))


@eqx.filter_jit
def _take_in(encoder: Encoder, memory: EncoderCarry, transition: Transition) -> tuple[EncoderCarry, Belief]:
    return encoder.step(memory, transition)


@eqx.filter_jit
def _read(
    probe: Probe, mixture: MixturePrior | None, belief: Belief
) -> tuple[Int[Array, ""], Float[Array, ""], Float[Array, " family"], Float[Array, " family"], Float[AnyArray, " K"]]:
    shares = jnp.zeros(0) if mixture is None else mixture.shares(belief.mean)
    return *probe(belief), probe.probabilities(belief), probe.chances_of_front(belief), shares
