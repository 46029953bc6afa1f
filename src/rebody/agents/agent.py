"""An agent: what it remembers, and one decision."""

from abc import abstractmethod
from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float, Int

from rebody.agents.slots import SlotChooser
from rebody.bodies.toys import Toy
from rebody.control.high_level import HighLevelPolicy
from rebody.control.places import TaskCode
from rebody.control.slot_policy import SlotPolicy
from rebody.inference.reader import PlaceReader
from rebody.tasks import FamilySet
from rebody.types import AnyArray, Belief, GlobalState, Subgoal, Task, Transition

SURE = 0.2
"""A target is known for sure where its standard deviation is below this share of its family's tolerance."""


class Observation(eqx.Module):
    """What an agent hears at a decision; the reward is that of the decision just ended."""

    state: GlobalState
    reward: Float[AnyArray, "*batch"]
    heard: Bool[AnyArray, "*batch"] | None = None
    """Where the reward was heard; None for everywhere. Elsewhere it means nothing, and memories must have the episode
    first in every array."""


class Command(eqx.Module):
    """What an agent says: an action for a toy, a subgoal for a robot's tracker."""

    action: Float[AnyArray, "*batch action"]
    subgoal: Subgoal


@runtime_checkable  # so that annotations can be checked
class Inferrer(Protocol):
    """What believes: a trained encoder, or the exact posterior in its place."""

    def initial(self, shape: tuple[int, ...]) -> Any:
        """Its memory before anything is seen."""
        ...

    def prior(self, shape: tuple[int, ...]) -> Belief:
        """The belief before anything is seen."""
        ...

    def step(self, memory: Any, transition: Transition, /) -> tuple[Any, Belief]:
        """Take in a transition."""
        ...

    def unheard(self, memory: Any, transition: Transition, /) -> Any:
        """Its memory after a transition whose reward was not heard; the belief stays."""
        ...


Reader = Callable[[Belief], tuple[Int[AnyArray, "*batch"], Float[AnyArray, "*batch axis"]]]
"""Says which family and target a belief speaks of."""


class Carry(eqx.Module):
    """What an agent remembers from one decision to the next."""

    memory: Any  # of its inferrer
    belief: Belief
    previous: GlobalState
    command: Command
    decisions: Int[AnyArray, ""]


class Agent(eqx.Module):
    """Serves toy and robot alike; holds nothing that learns."""

    inferrer: Inferrer
    reader: Reader
    families: FamilySet = eqx.field(static=True)
    """What its subgoals are about."""
    stride: int = eqx.field(static=True)

    def begin(self, state: GlobalState) -> tuple[Carry, Command]:
        """The first decision of an episode, when nothing is known."""
        shape = state.x.shape
        belief = self.inferrer.prior(shape)
        first = jnp.zeros((), jnp.int32)
        command = self.command(state, belief, first)
        carry = Carry(self.inferrer.initial(shape), belief, state, command, first + 1)
        return carry, command

    def decide(self, carry: Carry, observation: Observation) -> tuple[Carry, Command]:
        """Take in the transition since the last decision, but for episodes in which no reward was heard; speak anew at
        every `stride`-th.
        """
        transition = Transition(carry.previous, observation.reward, observation.state)
        memory, belief = self.inferrer.step(carry.memory, transition)
        if observation.heard is not None:
            missed = self.inferrer.unheard(carry.memory, transition), carry.belief
            memory, belief = _chosen(observation.heard, (memory, belief), missed)
        return self._speak(carry, memory, belief, observation.state)

    def pass_over(self, carry: Carry, state: GlobalState) -> tuple[Carry, Command]:
        """A decision before which no reward was heard: the belief stays as it is, time goes on."""
        transition = Transition(carry.previous, jnp.zeros(state.x.shape), state)
        return self._speak(carry, self.inferrer.unheard(carry.memory, transition), carry.belief, state)

    def _speak(self, carry: Carry, memory: Any, belief: Belief, state: GlobalState) -> tuple[Carry, Command]:
        fresh = self.command(state, belief, carry.decisions)
        speaks = carry.decisions % self.stride == 0
        command = jax.tree.map(lambda new, held: jnp.where(speaks, new, held), fresh, carry.command)
        return Carry(memory, belief, state, command, carry.decisions + 1), command

    @abstractmethod
    def command(self, state: GlobalState, belief: Belief, decision: Int[AnyArray, ""]) -> Command:
        """What to do in this state, believing this, at this decision of the episode (the first is 0)."""


class ReuseAgent(Agent):
    """The toy's frozen policy, imagined from where the robot is (thesis 5.6.2, 6.4)."""

    toy: Toy
    slots: SlotChooser
    """Which slot a robot's subgoals go to; a point mass has none."""
    horizon: int = eqx.field(static=True)

    def command(self, state: GlobalState, belief: Belief, decision: Int[AnyArray, ""]) -> Command:
        """The policy's action for a toy; for a robot, where that policy would lead a toy from here."""
        action = self.acting(belief)(state)
        slot = self.slots(belief)
        return Command(action, Subgoal(slot, self.families.achieved_by_way_of(slot, self.imagine(state, belief))))

    def imagine(self, state: GlobalState, belief: Belief) -> GlobalState:
        """Where the nominal toy would be after each of `horizon` decisions, [decision, *batch], the belief held."""
        return self.toy.imagine(state, self.acting(belief), self.horizon)

    @abstractmethod
    def acting(self, belief: Belief) -> Callable[[GlobalState], Float[AnyArray, "*batch action"]]:
        """What moves the toy while this is believed."""


class BelievingReuseAgent(ReuseAgent):
    """By a policy that learned to act by beliefs."""

    interpret: Callable[[Belief], Belief]
    """What the policy sees of a belief."""
    high_level: HighLevelPolicy

    def acting(self, belief: Belief) -> Callable[[GlobalState], Float[AnyArray, "*batch action"]]:
        """That policy."""
        understood = self.interpret(belief)
        return lambda state: self.high_level(state, understood)


class ToldReuseAgent(ReuseAgent):
    """By a policy that is told the task: the likeliest one."""

    told_policy: HighLevelPolicy
    task_code: TaskCode

    def acting(self, belief: Belief) -> Callable[[GlobalState], Float[AnyArray, "*batch action"]]:
        """That policy."""
        told = self.task_code(Task(*self.reader(belief)))
        return lambda state: self.told_policy(state, told)


class SharpReuseAgent(BelievingReuseAgent):
    """`reuse` of sharpened beliefs: where a target is known for sure, the toy's policy is the one that was told it.

    A policy that learned with an encoder's beliefs is as exact as those were. Both are frozen, and learned on the toy.
    """

    reader: PlaceReader
    told_policy: HighLevelPolicy
    task_code: TaskCode

    def acting(self, belief: Belief) -> Callable[[GlobalState], Float[AnyArray, "*batch action"]]:
        """By the policy that was told its task where the belief is sure, else by the one that reads beliefs."""
        by_belief, sure = super().acting(belief), self.is_sure(belief)
        told = self.task_code(Task(*self.reader(belief)))
        return lambda state: jnp.where(sure[..., None], self.told_policy(state, told), by_belief(state))

    def is_sure(self, belief: Belief) -> Bool[AnyArray, "*batch"]:
        """Whether the standard deviation of the likeliest family's target is small beside its tolerance."""
        which, _ = self.reader(belief)
        spreads = zip(self.reader.families, self.reader.spreads(belief), strict=True)
        sure = [jnp.max(deviation, axis=-1) < SURE * family.tolerance for family, (_, deviation) in spreads]
        return jnp.take_along_axis(jnp.stack(sure, axis=-1), which[..., None], axis=-1)[..., 0]


class ToldAgent(Agent):
    """Takes a task for true: its target is the subgoal, and on a toy it acts by a policy that is told it."""

    told_policy: HighLevelPolicy
    task_code: TaskCode

    def command(self, state: GlobalState, belief: Belief, decision: Int[AnyArray, ""]) -> Command:
        """The best for that task."""
        task = self.task(belief, decision)
        return Command(self.told_policy(state, self.task_code(task)), Subgoal(task.family, task.target))

    @abstractmethod
    def task(self, belief: Belief, decision: Int[AnyArray, ""]) -> Task:
        """The task that it takes for true."""


class OracleAgent(ToldAgent):
    """Told the truth. Its inferrer only listens."""

    tasks: Task  # the active ones, [time, episode]

    def task(self, belief: Belief, decision: Int[AnyArray, ""]) -> Task:
        """The one that is active now."""
        return jax.tree.map(lambda field: jnp.take(field, decision, axis=0, mode="clip"), self.tasks)


class ReadoutAgent(ToldAgent):
    """Takes for true what is read from its belief: `readout` by a linear probe, `bayes` the posterior's mode."""

    def task(self, belief: Belief, decision: Int[AnyArray, ""]) -> Task:
        """What the belief speaks of."""
        return Task(*self.reader(belief))


class RetrainAgent(Agent):
    """A high-level policy that was learned on the robot makes subgoals of beliefs (thesis 5.6.2, 6.5)."""

    interpret: Callable[[Belief], Belief]
    """What the policy sees of a belief."""
    policy: SlotPolicy

    def command(self, state: GlobalState, belief: Belief, decision: Int[AnyArray, ""]) -> Command:
        """For a robot alone: the action for a toy is not a number."""
        subgoal = self.policy(state, self.interpret(belief))
        return Command(jnp.full((*state.x.shape, 1), jnp.nan), subgoal)


class FlatAgent(Agent):
    """Only believes: a flat policy makes joint actions of that (thesis 6.3.2), so there is no subgoal."""

    def command(self, state: GlobalState, belief: Belief, decision: Int[AnyArray, ""]) -> Command:
        """Nothing: the value is not a number."""
        none = jnp.full((*state.x.shape, self.families.size), jnp.nan)
        return Command(none[..., :1], Subgoal(jnp.zeros(state.x.shape, jnp.int32), none))


class IdleAgent(Agent):
    """Knows nothing and stands still: what a body without inference would get."""

    actions: int = eqx.field(static=True)
    """Numbers in a toy's action."""

    def command(self, state: GlobalState, belief: Belief, decision: Int[AnyArray, ""]) -> Command:
        """No force; of a robot, a speed of zero where the families have a speed, else where it began."""
        return Command(jnp.zeros((*state.x.shape, self.actions)), standing_still(self.families, state.x.shape))


def _chosen(which: Bool[AnyArray, "*batch"], yes: Any, no: Any) -> Any:
    """Of two trees whose arrays begin with the shape of `which`."""

    def of_leaf(yes, no):
        return jnp.where(jnp.reshape(which, which.shape + (1,) * (yes.ndim - which.ndim)), yes, no)

    return jax.tree.map(of_leaf, yes, no)


def standing_still(families: FamilySet, shape: tuple[int, ...]) -> Subgoal:
    """A speed of zero; where there is no slot for speeds, the rest pose."""
    speeds = [i for i, family in enumerate(families) if not family.is_pose and family.settle != "largest of 1 s"]
    return Subgoal(jnp.full(shape, speeds[0] if speeds else 0, jnp.int32), jnp.zeros((*shape, families.size)))
