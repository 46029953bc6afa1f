"""Transitions for policies that learn off-policy: an empty ring of them, and learning from batches drawn from it."""

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Float, PRNGKeyArray

from rebody.control import sac
from rebody.control.sac import Judge, SACBatch, SACConfig, SACState, whole
from rebody.types import AnyArray


def no_transitions(rows: int, features: int, actions: int) -> SACBatch:
    """A ring of so many rows in host memory (`rebody.training.ring`), nothing written yet."""
    return SACBatch(
        observation=np.zeros((rows, features), np.float32),
        action=np.zeros((rows, actions), np.float32),
        reward=np.zeros(rows, np.float32),
        next_observation=np.zeros((rows, features), np.float32),
        terminal=np.zeros(rows, np.float32),
    )


@eqx.filter_jit
def learn(
    policy: SACState, batches: SACBatch, key: PRNGKeyArray, config: SACConfig, judge: Judge = whole
) -> tuple[SACState, dict[str, Float[AnyArray, ""]]]:
    """One update of soft actor-critic per batch; `batches` have the update first in every array."""
    keys = jax.random.split(key, len(batches.reward))
    return sac.update_many(policy, lambda batch, _: batch, batches, keys, config, judge)
