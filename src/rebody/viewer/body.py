"""A body that is watched: a robot or a point mass, stepped by what its agent says."""

from collections import deque
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from rebody.agents.agent import Command
from rebody.agents.controller import Controller
from rebody.agents.rollout import follow
from rebody.bodies import RobotBatch, RobotSpec
from rebody.bodies.toy_models import toy_model
from rebody.bodies.toys import Toy, ToyState
from rebody.types import Belief, GlobalState


class RobotBody:
    """A robot under its controller. A step is a control step; global states have the shape [1]."""

    def __init__(self, spec: RobotSpec, controller: Controller):
        self.model, self.steps_per_decision = spec.model, spec.steps_per_decision
        self.x_address = spec.root_addresses[0]
        self._controller = controller
        self._batch = RobotBatch(spec, 1, threads=1)
        self._trail: deque[Float[np.ndarray, "1 nq"]] = deque(maxlen=spec.steps_per_decision + 1)  # over the last 0.1 s

    @property
    def qpos(self) -> Float[np.ndarray, " nq"]:
        """A copy of the model's joint positions [m, rad]."""
        return self._batch.qpos[0].copy()

    def reset(self, seed: int) -> None:
        """In the rest pose at x = 0, with Gymnasium's reset noise."""
        self._batch.reset(np.random.default_rng(seed))
        self._trail.clear()
        self._trail.append(self._batch.qpos.copy())

    def step(self, command: Command, belief: Belief) -> None:
        """One control step towards the subgoal; only a policy without hierarchy looks at the belief."""
        follow(self._controller, self._batch, command.subgoal, belief)
        self._trail.append(self._batch.qpos.copy())

    def push(self, change: float) -> None:
        """Change every part's velocity along x alike [m/s]."""
        self._batch.push(np.array([change]))

    def observe(self) -> GlobalState:
        """By the robot's observation mapping; velocities are means over the last 0.1 s."""
        return self._batch.spec.observe(self._trail[-1], self._trail[0])

    @property
    def has_fallen(self) -> bool:
        """Whether it lies on the ground, as its description defines it."""
        return bool(self._batch.fallen[0])


class ToyBody:
    """A nominal point mass, which takes the agent's action itself. A step is a decision."""

    x_address, steps_per_decision, has_fallen = 0, 1, False

    def __init__(self, toy: Toy):
        self.model = toy_model(toy)
        self._toy = toy
        self.reset(0)

    @property
    def qpos(self) -> Float[np.ndarray, " nq"]:
        """x, and for a toy that has them z and pitch."""
        state = self._state
        return np.concatenate([state.x, state.z, state.pitch], dtype=float)[: self.model.nq]

    def reset(self, seed: int) -> None:
        """At x = 0 at rest, whatever the seed."""
        still = jnp.zeros(1)
        self._state = self._toy.initial(still, still)

    def step(self, command: Command, belief: Belief) -> None:
        """One decision of the toy."""
        self._state = _advance(self._toy, self._state, command)

    def push(self, change: float) -> None:
        """Change its velocity along x [m/s]; a position toy, which has no momentum, does not mind."""
        state = self._state
        self._state = replace(state, vx=state.vx + change, drift=state.drift + change)

    def observe(self) -> GlobalState:
        """The toy's own readout."""
        return self._toy.observe(self._state)


Body = RobotBody | ToyBody


@eqx.filter_jit
def _advance(toy: Toy, state: ToyState, command: Command) -> ToyState:
    return toy.step(state, command.action, jax.random.key(0))  # a nominal toy has no noise
