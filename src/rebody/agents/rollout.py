"""Episodes of an agent on a toy (one compiled scan) and on robots (a loop on the host)."""

from collections.abc import Callable, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from rebody.agents.agent import Agent, Observation
from rebody.agents.clock import Clock, EvenClock
from rebody.agents.controller import Controller
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
) -> Episodes:
    """Episodes on a toy at home and at rest, or from `start` [episode]; `tasks` are the active ones, [time, episode],
    of `families`.

    `reward_noise` is the standard deviation of what the agent hears around what is earned, in the reward's unit.
    """
    still = jnp.zeros(tasks.family.shape[1])
    body = toy.begin(global_state(x=still) if start is None else start, disturbance)
    carry, command = agent.begin(toy.observe(body))

    def advance(walk, inputs):
        body, carry, command = walk
        task, key = inputs
        body = toy.step(body, command.action, key)
        state = toy.observe(body)
        earned = families.reward(task, state)
        noise = reward_noise * jax.random.normal(jax.random.fold_in(key, 1), earned.shape)
        carry, following = agent.decide(carry, Observation(state, earned + noise))
        return (body, carry, following), (state, earned, carry.belief, command.subgoal)

    keys = jax.random.split(jax.random.key(0), len(tasks.family))
    _, (state, earned, belief, subgoal) = jax.lax.scan(advance, (body, carry, command), (tasks, keys))
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
    ):
        """Without a controller the agent's own action moves them, as on a point mass.

        The clock says when the agent decides (thesis mode, 6.3.3); default is every 0.1 s.
        """
        self.agent, self.steps = agent, 0
        self._controller, self._body = controller, body
        self._families = families
        self._clock = clock or EvenClock(body.steps_per_decision)
        self.carry, self.command = self._clock.begin(agent, body.observe())
        self._steps_left = self._clock.steps(body, self.command.subgoal)

    def step(self, task: Task) -> Observation | None:
        """One step of the bodies and the decisions that are due then; what there is to hear, at least every 0.1 s."""
        body, held = self._body, self.command
        if self._controller is None:
            body.step(np.asarray(held.action))
        else:
            follow(self._controller, body, held.subgoal, self.carry.belief)
        self.steps, self._steps_left = self.steps + 1, self._steps_left - 1
        due = self._steps_left == 0
        if not due.any() and self.steps % body.steps_per_decision:
            return None
        state = body.observe()
        heard = Observation(state, task_reward(self._families, task, state))
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
) -> Episodes:
    """Episodes on robots from x = 0 at rest; `tasks` are the active ones, [time, episode], and the reset noise of each
    episode is drawn from its number in `starts`.

    Nothing ends early: a fallen robot lies there and keeps scoring. `on_frame` is called at every control step.
    What is returned is 0.1 s apart, whatever the clock. `make` gives the robots another body than their own.
    """
    decisions, size = tasks.family.shape
    body = make(spec, size)
    for episode, seed in enumerate(starts):
        body.reset(np.random.default_rng(seed), np.arange(size) == episode)
    drive = Drive(agent, controller, body, families, clock)
    fell, records = np.zeros(size, bool), []
    for step in range(decisions * body.steps_per_decision):
        i, of_decision = divmod(step, body.steps_per_decision)
        held = drive.command.subgoal
        heard = drive.step(Task(tasks.family[i], tasks.target[i]))
        fell |= body.fallen
        if on_frame is not None:
            on_frame(body, held)
        if heard is not None and of_decision == body.steps_per_decision - 1:
            records.append((heard.state, heard.reward, drive.carry.belief, held))
    state, earned, belief, subgoal = jax.tree.map(lambda *steps: np.stack(steps), *records)
    return Episodes(state, earned, belief, subgoal, fell)


def follow(controller: Controller, body: Simulation, subgoal: Subgoal, belief: Belief | None = None) -> None:
    """One control step of every robot."""
    pose = body.pose().astype(np.float32)
    body.step(np.asarray(joint_action(controller, controller.see(body), pose, subgoal, belief)))


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


@eqx.filter_jit
def task_reward(families: FamilySet, task: Task, state: GlobalState) -> Float[AnyArray, "*episode"]:
    """`FamilySet.reward`, compiled."""
    return families.reward(task, state)
