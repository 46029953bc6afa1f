"""What the frozen module believes over an episode: it listens again to what the episode's result says."""

from typing import Any

import numpy as np

from rebody.agents.belief import Reading
from rebody.agents.parts import Inference
from rebody.evaluation.episode import EpisodeResult
from rebody.evaluation.trial import Trial
from rebody.types import DECISION_DT, RATE_OF


def listen(inference: Inference, episode: EpisodeResult, sharpen: bool) -> list[Reading] | None:
    """A reading after each decision; None where the result does not tell all that the module sees."""
    seen = _seen(episode)
    if not set(inference.contract.fields) <= seen.keys():
        return None
    states = [{field: float(series[i]) for field, series in seen.items()} for i in range(len(episode.time_s))]
    belief = inference.begin(_before(states[0]), sharpen)
    return [belief.update(state, reward) for state, reward in zip(states, episode.reward, strict=True)]


def listen_beside(trial: Trial, episode: EpisodeResult) -> list[Reading] | None:
    """`listen` as a trial's agent does; None also where a law of payment is between what is earned and heard."""
    return None if trial.payment else listen(trial.inference, episode, trial.sharpens)


def _seen(episode: EpisodeResult) -> dict[str, Any]:
    """Fields of the global state over time, from the quantities of the families in play."""
    fields = {}
    for family in episode.families:
        quantity = family.quantity
        if quantity.name in episode.quantities and quantity.frame == "world":
            series = np.reshape(episode.quantities[quantity.name], (-1, family.size))
            fields |= dict(zip(quantity.components, series.T, strict=True))
    return fields


def _before(state: dict[str, float]) -> dict[str, float]:
    """The state at the start, at rest: velocities are displacements."""
    moved = {RATE_OF[field]: DECISION_DT * speed for field, speed in state.items() if field in RATE_OF}
    return {field: 0.0 if field in RATE_OF else value - moved.get(field, 0.0) for field, value in state.items()}
