"""Beliefs on the toy: what the classifier learns from, and what the slots of clusters are found on."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from rebody.agents.agent import Agent, Command, ReuseAgent
from rebody.agents.build import build_agent
from rebody.agents.parts import Inference
from rebody.agents.rollout import Episodes, rollout_on_toy
from rebody.agents.slots import OneSlot
from rebody.bodies.toys import Disturbance
from rebody.inference.mixture.padded import MixturePrior
from rebody.tasks.quantities import length
from rebody.types import AnyArray, Belief, GlobalState, Task

KNOWN_FROM = 20
"""Decisions after which a belief counts in judging slots: before them little is known."""
HOLD = 5
"""Decisions for which the toy's tracker thinks of holding an action."""


def act(module: Inference, tasks: Task, disturbance: Disturbance) -> Episodes:
    """What the module believes while its own policy acts on the toy."""
    agent = build_agent("reuse", module, horizon=1)
    return rollout_on_toy(agent, module.toy, tasks, module.contract.families, disturbance)


class TrackingToy(Agent):
    """`reuse` with a tracker for the toy: the held action whose outcome is nearest to the subgoal.

    So it shows what a slot is worth, as a robot with a tracker would, and costs no robot.
    """

    reuse: ReuseAgent

    def command(self, state: GlobalState, belief: Belief, decision: Int[AnyArray, ""]) -> Command:
        """The subgoal of the slot, and the action that brings it about."""
        subgoal = self.reuse.command(state, belief, decision).subgoal
        families, toy, actions = self.families, self.reuse.toy, self.reuse.toy.actions
        steps = jnp.linspace(-1.0, 1.0, 41)
        candidates = jnp.concatenate([steps[:, None] * jnp.eye(actions)[i] for i in range(actions)])

        def outcome(action: Float[AnyArray, " action"]) -> Float[AnyArray, "*batch"]:
            held = jnp.broadcast_to(action, (*state.x.shape, actions))
            states = toy.imagine(state, lambda _: held, HOLD)
            reached = families.achieved_by_way_of(subgoal.slot, states)
            return length(families.difference(subgoal.slot, reached, subgoal.value))

        nearest = jnp.argmin(jax.vmap(outcome)(candidates), axis=0)
        return Command(candidates[nearest], subgoal)


def slots_of_clusters(module: Inference, tasks: Task, disturbance: Disturbance) -> Int[np.ndarray, " K"]:
    """For each component of the module's mixture, the slot that earns most on the toy; no labels are used."""
    mixture = module.parts.mixture
    assert mixture is not None
    slots = range(len(module.contract.families))
    earned = np.stack([_earned(module, mixture, slot, tasks, disturbance) for slot in slots])
    return np.argmax(earned, axis=0).astype(np.int32)


def _earned(module: Inference, mixture: MixturePrior, slot: int, tasks: Task, disturbance: Disturbance):
    """Mean reward of the decisions in which each component was believed, all subgoals in one slot."""
    reuse = build_agent("reuse", module, slots=OneSlot(slot))  # as far ahead as on a robot
    assert isinstance(reuse, ReuseAgent)
    tracking = TrackingToy(reuse.inferrer, reuse.reader, reuse.families, reuse.stride, reuse)
    episodes = rollout_on_toy(tracking, module.toy, tasks, module.contract.families, disturbance)
    believed = eqx.filter_jit(mixture.component)(episodes.belief.mean)[KNOWN_FROM - 1 : -1]
    is_component = np.asarray(believed)[..., None] == np.arange(len(mixture.active))
    reward = np.asarray(episodes.reward)[KNOWN_FROM:, :, None]
    return np.sum(reward * is_component, axis=(0, 1)) / np.maximum(is_component.sum(axis=(0, 1)), 1)
