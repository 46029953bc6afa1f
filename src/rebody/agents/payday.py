"""Paydays: what of their earnings agents hear, late, noisy and with gaps."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int, Key

from rebody.agents.agent import Agent, Inferrer
from rebody.tasks import FamilySet, Payment
from rebody.types import AnyArray, Belief, GlobalState, Task, Transition


class Payday(eqx.Module):
    """Earnings of episodes on their way to the agent; each decision makes the next payday."""

    payment: Payment = eqx.field(static=True)
    keys: Key[AnyArray, " episode"]
    """What noise and gaps are drawn from, by the decision."""
    owed: Float[AnyArray, "late episode"]
    """What was earned and is not heard yet, the oldest first."""
    decision: Int[AnyArray, ""]

    def pay(
        self, families: FamilySet, task: Task, state: GlobalState, actions: Float[AnyArray, "step episode action"]
    ) -> tuple["Payday", Float[AnyArray, " episode"], Float[AnyArray, " episode"], Bool[AnyArray, " episode"] | None]:
        """One decision that led to `state` by these actions: the next payday, what is earned, what is heard, and in
        which episodes (None: in all).
        """
        payment = self.payment
        earned = families.reward(task, state, payment.law) - payment.cost(actions).mean(axis=0)
        due = jnp.concatenate([self.owed, earned[None]])
        keys = jax.vmap(jax.random.fold_in, (0, None))(self.keys, self.decision)
        noise_keys, gap_keys = jnp.moveaxis(jax.vmap(jax.random.split)(keys), 1, 0)
        heard = due[0] + payment.noise * jax.vmap(jax.random.normal)(noise_keys)
        following = replace(self, owed=due[1:], decision=self.decision + 1)
        if not payment.has_gaps:
            return following, earned, heard, None
        is_kept = jax.vmap(lambda key: jax.random.bernoulli(key, 1 - payment.dropped))(gap_keys)
        is_heard = is_kept & (self.decision >= payment.delay)
        return following, earned, jnp.where(is_heard, heard, 0.0), is_heard

    def hired(self, agent: Agent) -> Agent:
        """The agent, with a memory of its own for each episode where one may hear what another misses."""
        return replace(agent, inferrer=OneByOne(agent.inferrer)) if self.payment.has_gaps else agent


def first_payday(payment: Payment | None, starts: Sequence[int] | Int[np.ndarray, " episode"]) -> Payday | None:
    """Before the first decision of episodes whose noise and gaps are drawn from these numbers; None for families that
    pay by their own laws.
    """
    if payment is None:
        return None
    keys = jax.vmap(jax.random.key)(np.array([int(start) % 2**32 for start in starts], np.uint32))
    return Payday(payment, keys, jnp.zeros((payment.delay, len(starts))), jnp.zeros((), jnp.int32))


class OneByOne(eqx.Module):
    """An inferrer whose memory has the episode first in every array, so that each can hear at its own times."""

    inferrer: Inferrer

    def initial(self, shape: tuple[int, ...]) -> Any:
        """The same for all."""
        return jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, (*shape, *leaf.shape)), self.inferrer.initial(()))

    def prior(self, shape: tuple[int, ...]) -> Belief:
        """As ever."""
        return self.inferrer.prior(shape)

    def step(self, memory: Any, transition: Transition) -> tuple[Any, Belief]:
        """Each takes in its own transition."""
        return self._each(self.inferrer.step, transition)(memory, transition)

    def unheard(self, memory: Any, transition: Transition) -> Any:
        """Each sees its own transition."""
        return self._each(self.inferrer.unheard, transition)(memory, transition)

    def _each(self, of_one: Any, transition: Transition) -> Any:
        for _ in transition.state.x.shape:
            of_one = jax.vmap(of_one)
        return of_one
