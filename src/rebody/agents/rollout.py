"""Episodes of an agent on a toy (one compiled scan) and on robots (a loop on the host)."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from rebody.agents.agent import Agent, Observation
from rebody.agents.clock import Clock, EvenClock
from rebody.agents.controller import Controller
from rebody.agents.payday import Payday
from rebody.bodies import RobotSpec, Simulation, simulate
from rebody.bodies.disturbance import Disturbance
from rebody.bodies.toys import Toy
from rebody.tasks import FamilySet
from rebody.types import AnyArray, Belief, GlobalState, Pose, Subgoal, Task, global_state

Starts = Sequence[int] | Int[np.ndarray, " episode"]
"""What the reset noise of each episode is drawn from."""
OnFrame = Callable[[Simulation, Subgoal], None]


class Episodes(eqx.Module):
    """What happened; entry i is the state after decision i, its belief includes decision i's transition."""

    state: GlobalState  # [time, episode]
    reward: Float[AnyArray, "time episode"]
    belief: Belief  # [time, episode]
    subgoal: Subgoal  # [time, episode], the one held during decision i
    fell: Bool[AnyArray, " episode"]


@eqx.filter_jit
def rollout_on_toy(
    agent: Agent,
    toy: Toy,
    tasks: Task,
    families: FamilySet,
    disturbance: Disturbance | None = None,
    reward_noise: float = 0.0,
    start: GlobalState | None = None,
    payday: Payday | None = None,
) -> Episodes:
    """Episodes on a toy at home and at rest, or from `start` [episode]; `tasks` are the active ones, [time, episode],
    of `families`.

    `reward_noise` is the standard deviation of what the agent hears around what is earned, in the reward's unit. It is
    paid by each family's own law, or as the first `payday` says.
    """
    agent = payday.hired(agent) if payday else agent
    still = jnp.zeros(tasks.family.shape[1])
    body = toy.begin(global_state(x=still) if start is None else start, disturbance)
    carry, command = agent.begin(toy.observe(body))

    def advance(walk, inputs):
        body, carry, command, payday = walk
        task, key = inputs
        body = toy.step(body, command.action, key)
        state = toy.observe(body)
        payday, earned, observation = paid(payday, families, task, state, [command.action])
        noise = reward_noise * jax.random.normal(jax.random.fold_in(key, 1), earned.shape)
        carry, following = agent.decide(carry, replace(observation, reward=observation.reward + noise))
        return (body, carry, following, payday), (state, earned, carry.belief, command.subgoal)

    keys = jax.random.split(jax.random.key(0), len(tasks.family))
    _, (state, earned, belief, subgoal) = jax.lax.scan(advance, (body, carry, command, payday), (tasks, keys))
    return Episodes(state, earned, belief, subgoal, still > 0)


class Drive:
    """Bodies that move as an agent says, a step at a time: the one loop on the host."""

    def __init__(
        self,
        agent: Agent,
        controller: Controller | None,
        body: Simulation,
        families: FamilySet,
        clock: Clock | None = None,
        payday: Payday | None = None,
    ):
        """Without a controller the agent's own action moves them, as on a point mass.

        The clock says when the agent decides (thesis mode, 6.3.3); default is every 0.1 s, which a payday needs.
        Without one each family pays by its own law.
        """
        self.agent, self.steps = payday.hired(agent) if payday else agent, 0
        self._payday, self._actions = payday, []
        self._controller, self._body = controller, body
        self._families = families
        self._clock = clock or EvenClock(body.steps_per_decision)
        self.carry, self.command = self._clock.begin(self.agent, body.observe())
        self._steps_left = self._clock.steps(body, self.command.subgoal)

    def step(self, task: Task) -> Observation | None:
        """One step of the bodies and the decisions that are due then; what there is to hear, at least every 0.1 s.

        What was earned meanwhile is in `earned` then.
        """
        body, held = self._body, self.command
        if self._controller is None:
            body.step(np.asarray(held.action))
        else:
            follow(self._controller, body, held.subgoal, self.carry.belief)
        self._actions.append(body.joint_actions)
        self.steps, self._steps_left = self.steps + 1, self._steps_left - 1
        due = self._steps_left == 0
        if not due.any() and self.steps % body.steps_per_decision:
            return None
        state = body.observe()
        self._payday, self.earned, heard = paid(self._payday, self._families, task, state, self._actions)
        self._actions = []
        if due.any():
            self.carry, self.command = self._clock.decide(self.agent, self.carry, heard, due)
            self._steps_left = np.where(due, self._clock.steps(body, self.command.subgoal), self._steps_left)
        return heard


def rollout_on_robot(
    agent: Agent,
    controller: Controller,
    spec: RobotSpec,
    tasks: Task,
    families: FamilySet,
    starts: Starts,
    on_frame: OnFrame | None = None,
    clock: Clock | None = None,
    make: Callable[[RobotSpec, int], Simulation] = simulate,
    payday: Payday | None = None,
) -> Episodes:
    """Episodes on robots from x = 0 at rest; `tasks` are the active ones, [time, episode], and the reset noise of each
    episode is drawn from its number in `starts`.

    Nothing ends early: a fallen robot lies there and keeps scoring. `on_frame` is called at every control step.
    What is returned is 0.1 s apart, whatever the clock. `make` gives the robots another body than their own. They are
    paid by each family's own law, or as the first `payday` says.
    """
    decisions, size = tasks.family.shape
    body = make(spec, size)
    for episode, seed in enumerate(starts):
        body.reset(np.random.default_rng(seed), np.arange(size) == episode)
    drive = Drive(agent, controller, body, families, clock, payday)
    fell, records = np.zeros(size, bool), []
    for step in range(decisions * body.steps_per_decision):
        i, of_decision = divmod(step, body.steps_per_decision)
        held = drive.command.subgoal
        heard = drive.step(Task(tasks.family[i], tasks.target[i]))
        fell |= body.fallen
        if on_frame is not None:
            on_frame(body, held)
        if heard is not None and of_decision == body.steps_per_decision - 1:
            records.append((heard.state, drive.earned, drive.carry.belief, held))
    state, earned, belief, subgoal = jax.tree.map(lambda *steps: np.stack(steps), *records)
    return Episodes(state, earned, belief, subgoal, fell)


def follow(
    controller: Controller, body: Simulation, subgoal: Subgoal, belief: Belief | None = None
) -> Float[np.ndarray, "robot action"]:
    """One control step of every robot; the actions that were taken."""
    pose = body.pose().astype(np.float32)
    action = np.asarray(joint_action(controller, controller.see(body), pose, subgoal, belief))
    body.step(action)
    return action


@eqx.filter_jit
def joint_action(
    controller: Controller,
    joints: Float[AnyArray, "*episode joint"],
    pose: Pose,
    subgoal: Subgoal,
    belief: Belief | None,
) -> Float[AnyArray, "*episode action"]:
    """What the controller does with the joints of robots in these poses."""
    return controller(joints, pose, subgoal, belief)


def paid(
    payday: Payday | None,
    families: FamilySet,
    task: Task,
    state: GlobalState,
    actions: Sequence[Float[AnyArray, "episode action"]],
) -> tuple[Payday | None, Float[AnyArray, " episode"], Observation]:
    """One decision that led to `state` by these actions: the next payday, what is earned, and what there is to hear."""
    if payday is None:
        earned = _own_reward(families, task, state)
        return None, earned, Observation(state, earned)
    payday, earned, heard, is_heard = _pay(payday, families, task, state, jnp.stack(actions))
    return payday, earned, Observation(state, heard, is_heard)


@eqx.filter_jit
def _own_reward(families: FamilySet, task: Task, state: GlobalState) -> Float[AnyArray, "*episode"]:
    return families.reward(task, state)


@eqx.filter_jit
def _pay(payday: Payday, families: FamilySet, task: Task, state: GlobalState, actions: Any) -> Any:
    return payday.pay(families, task, state, actions)
