"""A frozen module's belief about one task, told of it from outside: state and reward in, reading out."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from rebody import inputs
from rebody.agents.doubts import RECENT_S, RewardWatch
from rebody.agents.unknown import Explained, explained
from rebody.bodies.robot import wrap_angle
from rebody.errors import RebodyError
from rebody.inference import Encoder
from rebody.inference.any_law import SharpenedByAnyLaw
from rebody.inference.contract import Contract
from rebody.inference.covariance import believed_covariances, heard_covariances
from rebody.inference.mixture.padded import MixturePrior
from rebody.inference.probe import Probe
from rebody.inference.reader import PlaceReader
from rebody.inference.sharpened import Sharpened
from rebody.jax_settings import own_jax_settings
from rebody.types import ANGLES, DECISION_DT, GLOBAL_FIELDS, RATE_OF, Belief, GlobalState, Transition


@dataclass(frozen=True)
class Reading:
    """What is believed after a decision."""

    family: str
    """The likeliest."""
    target: tuple[float, ...]
    """In the units of the family's quantity (m, m/s, rad)."""
    covariance: Float[np.ndarray, "size size"]
    """Of the target, in the same units, by what was heard."""
    base_tasks: dict[tuple[str, str], float]
    """Probability of each base task that the module knows: a family and a direction, such as ("goal", "front")."""
    responsibilities: dict[int, float]
    """Of each of the mixture's clusters; empty where there is no mixture."""
    latent: Belief
    """Mean and variance; shapes [latent]."""
    explained: float | None = None
    """Share of the rewards' variance that the likeliest task explains, in [0, 1], of sharpened beliefs of a module that
    hears any law; None for others."""

    @property
    def probabilities(self) -> dict[str, float]:
        """Of each family."""
        families = dict.fromkeys((family for family, _ in self.base_tasks), 0.0)
        for (family, _), probability in self.base_tasks.items():
            families[family] += probability
        return families


class LiveBelief:
    """Takes in a decision at a time; `rebody.load_inference(name).begin(state)` makes one."""

    def __init__(
        self,
        inferrer: Encoder | Sharpened | SharpenedByAnyLaw,
        reader: Probe | PlaceReader,
        mixture: MixturePrior | None,
        contract: Contract,
        state: Any,
    ):
        self._inferrer, self._reader, self._mixture = inferrer, reader, mixture
        self.believed = 0
        """Decisions in which a reward was heard and believed."""
        self._decision, self._watch = 0, RewardWatch(contract)
        self._fields = contract.fields
        self._memory: Any = inferrer.initial()
        self._previous = _global_state(self._fields, state, None, "at the start")
        self._reading = self._read(inferrer.prior())

    @property
    def reading(self) -> Reading:
        """What is believed now; before the first update that of a belief that knows nothing."""
        return self._reading

    @own_jax_settings()
    def update(self, state: Any, reward: Any) -> Reading:
        """Take in a decision: the state 0.1 s after the last one, and the reward in between; what is believed now.

        `state` is a mapping with the fields that the module sees (m, rad, m/s, rad/s; others are not looked at). A
        velocity that is left out is the displacement over the decision. A `reward` of None means that nothing was
        heard; then, and where no task could have paid it (see `doubts`), the belief stays as it is. RebodyError, and
        nothing is taken in, where a field is missing, or a number is not finite or beyond `rebody.inputs.LARGEST`.
        """
        where = f"decision {self._decision + 1}"
        heard = inputs.reward(reward, where)
        now = _global_state(self._fields, state, self._previous, where)
        self._decision += 1
        transition = Transition(self._previous, np.asarray(heard or 0.0, np.float32), now)
        if heard is None:
            self._watch.pass_over()
        if heard is not None and self._watch.hear(self._previous, now, heard):
            self._memory, belief = _take_in(self._inferrer, self._memory, transition)
            self._reading = self._read(belief)
            self.believed += 1
        else:
            self._memory = _pass_over(self._inferrer, self._memory, transition)
        self._previous = now
        return self._reading

    @property
    def unexplained(self) -> int:
        """How many rewards there were last that no task which the module knows explains; 0 where one does. Only
        sharpened beliefs of a module that hears any law know."""
        return self._explained.rewards if self._explained and self._explained.is_unknown else 0

    def doubts(self, within_s: float = RECENT_S) -> tuple[str, ...]:
        """Sentences about rewards of the last seconds that no task could have paid, and that were not believed; of a
        module that hears any law, about rewards that no task explains."""
        return self._watch.doubts(within_s) + (self._explained.doubts if self._explained else ())

    def notes(self, within_s: float = RECENT_S) -> tuple[str, ...]:
        """Sentences about rewards of the last seconds that no task in the module's ranges would have paid."""
        return self._watch.notes(within_s)

    def _read(self, belief: Belief) -> Reading:
        read = jax.tree.map(np.asarray, _read(self._reader, self._mixture, belief))
        which, target, probabilities, spreads, shares = read
        families, family = self._reader.families, self._reader.families[which]
        self._explained: Explained | None = explained(self._inferrer, self._memory)
        clusters = [] if self._mixture is None else np.flatnonzero(self._mixture.active)
        return Reading(
            family=family.name,
            target=tuple(target[: family.size].tolist()),
            covariance=np.asarray(self._covariances(belief)[which]),
            base_tasks={
                (each.name, direction): float(share * chance)
                for each, share, spread in zip(families, probabilities, spreads, strict=True)
                for direction, chance in zip(each.direction_names, each.direction_chances(*spread), strict=True)
            },
            responsibilities={int(k): float(shares[k]) for k in clusters},
            latent=jax.tree.map(np.asarray, belief),
            explained=self._explained and self._explained.share,
        )

    def _covariances(self, belief: Belief) -> list[Float[jax.Array, "size size"]]:
        """Of each family's target."""
        if isinstance(self._inferrer, Sharpened | SharpenedByAnyLaw):
            return heard_covariances(self._inferrer, self._memory)
        return believed_covariances(self._reader, belief)


def _global_state(fields: tuple[str, ...], given: Any, previous: GlobalState | None, where: str) -> GlobalState:
    """What an encoder that sees these fields is shown."""
    if not isinstance(given, Mapping):
        raise RebodyError(f"{where}: the state is of type {type(given).__name__}; give a mapping such as {{'x': 0.0}}.")
    there = {field for field in GLOBAL_FIELDS if given.get(field) is not None}
    displaced = {RATE_OF[field] for field in fields if field in RATE_OF and field not in there}
    known = {
        field: inputs.number(given[field], f"the state's '{field}'", where)
        for field in sorted(there & {*fields, *displaced})
    }
    for field in fields:
        if field not in known:
            known[field] = _velocity(field, known, previous, where)
    known |= {angle: _wrapped(known[angle]) for angle in ANGLES if angle in known}
    return GlobalState(**{field: np.asarray(known.get(field, 0.0), np.float32) for field in GLOBAL_FIELDS})


def _velocity(field: str, known: Mapping[str, float], previous: GlobalState | None, where: str) -> float:
    """The displacement since the last decision over its time; nothing moved before the first."""
    position = RATE_OF.get(field)
    if position is None or position not in known:
        or_position = f", or {position}" if position else ""
        raise RebodyError(f"{where}: the state lacks '{field}': give {field}{or_position}.")
    if previous is None:
        return 0.0
    moved = known[position] - float(getattr(previous, position))
    return (_wrapped(moved) if position in ANGLES else moved) / DECISION_DT


def _wrapped(angle: float) -> float:
    return float(wrap_angle(np.asarray(angle)))


@eqx.filter_jit
def _take_in(
    inferrer: Encoder | Sharpened | SharpenedByAnyLaw, memory: Any, transition: Transition
) -> tuple[Any, Belief]:
    return inferrer.step(memory, transition)


@eqx.filter_jit
def _pass_over(inferrer: Encoder | Sharpened | SharpenedByAnyLaw, memory: Any, transition: Transition) -> Any:
    return inferrer.unheard(memory, transition)


@eqx.filter_jit
def _read(reader: Probe | PlaceReader, mixture: MixturePrior | None, belief: Belief) -> tuple[Any, ...]:
    """Family, target, probability of each family, mean and deviation of each one's target, of each cluster."""
    shares = jnp.zeros(0) if mixture is None else mixture.shares(belief.mean)
    return *reader(belief), reader.probabilities(belief), reader.spreads(belief), shares
