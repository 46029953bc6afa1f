"""When agents decide: all episodes at once, or each when the time of its own subgoal is up."""

from abc import abstractmethod

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from rebody.agents.agent import Agent, Carry, Command, Observation
from rebody.bodies import Simulation
from rebody.control.command import addressed, relative
from rebody.control.step_predictor import StepPredictor
from rebody.types import AnyArray, GlobalState, Pose, Subgoal


class Clock(eqx.Module):
    """Lets agents decide, and says when they will do so again."""

    @abstractmethod
    def begin(self, agent: Agent, state: GlobalState) -> tuple[Carry, Command]:
        """The first decision of every episode."""

    @abstractmethod
    def decide(
        self, agent: Agent, carry: Carry, observation: Observation, due: Bool[np.ndarray, " episode"]
    ) -> tuple[Carry, Command]:
        """A decision of the episodes that are due."""

    @abstractmethod
    def steps(self, body: Simulation, subgoal: Subgoal) -> Int[np.ndarray, " episode"]:
        """Control steps to the next decision of an episode that decided on that subgoal just now."""


class EvenClock(Clock):
    """All decide at once, every so many control steps."""

    every: int = eqx.field(static=True)

    def begin(self, agent, state):
        """`Agent.begin`."""
        return begin(agent, state)

    def decide(self, agent, carry, observation, due):
        """`Agent.decide`: all are due."""
        return decide(agent, carry, observation)

    def steps(self, body, subgoal):
        """Always the same."""
        return np.full(body.size, self.every)


class PredictedClock(Clock):
    """Each decides when its subgoal should have been reached (thesis 6.4.3)."""

    predictor: StepPredictor
    slots: tuple[int, ...] = eqx.field(static=True)
    """Of each family in play, its slot in the tracker (`slots_among`)."""

    def begin(self, agent, state):
        """Carry and command have the episode first in every array, so that each can go its own pace."""
        return _begin_each(agent, state)

    def decide(self, agent, carry, observation, due):
        """Those that are not due keep memory and command."""
        return _decide_each(agent, carry, observation, due)

    def steps(self, body, subgoal):
        """What the predictor says."""
        asked, pose = addressed(subgoal, self.slots), body.pose().astype(np.float32)
        return np.asarray(_predict(self.predictor, body.proprioception(), pose, asked))


@eqx.filter_jit
def begin(agent: Agent, state: GlobalState) -> tuple[Carry, Command]:
    """`Agent.begin`, compiled."""
    return agent.begin(state)


@eqx.filter_jit
def decide(agent: Agent, carry: Carry, observation: Observation) -> tuple[Carry, Command]:
    """`Agent.decide`, compiled."""
    return agent.decide(carry, observation)


@eqx.filter_jit
def pass_over(agent: Agent, carry: Carry, state: GlobalState) -> tuple[Carry, Command]:
    """`Agent.pass_over`, compiled."""
    return agent.pass_over(carry, state)


@eqx.filter_jit
def _begin_each(agent: Agent, state: GlobalState) -> tuple[Carry, Command]:
    return jax.vmap(agent.begin)(state)


@eqx.filter_jit
def _decide_each(
    agent: Agent, carry: Carry, observation: Observation, due: Bool[AnyArray, " episode"]
) -> tuple[Carry, Command]:
    def decide_one(carry, observation, is_due):
        decided, _ = agent.decide(carry, observation)
        return jax.tree.map(lambda new, held: jnp.where(is_due, new, held), decided, carry)

    carry = jax.vmap(decide_one)(carry, observation, due)
    return carry, carry.command


@eqx.filter_jit
def _predict(
    predictor: StepPredictor,
    joints: Float[AnyArray, "episode joint"],
    pose: Pose,
    subgoal: Subgoal,
) -> Int[AnyArray, " episode"]:
    return predictor(joints, relative(predictor.families, subgoal, pose))
