"""Off-policy training of a robot's policy: collect -> draw -> update -> now and then measure.

`iterate` is the loop of tracker, flat policy, high level and step predictor; each is a `Learner` that fills in its own.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Float, Int, PRNGKeyArray

from rebody.bodies import RobotBatch, RobotSpec, load_robot
from rebody.bodies.check import require_ready
from rebody.control import sac
from rebody.control.sac import ActionValue, Actor, SACBatch, SACConfig, SACState, value_of_action
from rebody.ranges import Copies, Count, Episodes, Number, Rows, Seconds, check_ranges
from rebody.training.replay import Replay
from rebody.training.run import Metrics, Run, measured
from rebody.types import AnyArray

World = TypeVar("World")


@dataclass(frozen=True, kw_only=True)
class OffPolicyConfig:
    """Settings of every off-policy training run."""

    robots: Copies = 64
    """Copies that move in parallel."""
    steps: Copies = 32
    """Control steps of each robot in an iteration."""
    updates: Count = 256
    """Updates in an iteration."""
    iterations: Number = 700
    """Length of the run."""
    evaluate_every: Count = 50
    """Iterations from one measurement on held-out tasks to the next."""
    held_out: Episodes = 100
    """Held-out tasks of a measurement."""
    held_out_s: Seconds = 20.0
    """Length of their episodes [s]."""
    replay: Rows = 500_000
    """Transitions kept."""
    sac: SACConfig = field(default_factory=SACConfig)
    """Hyperparameters of soft actor-critic."""


class OffPolicyState(eqx.Module, Generic[World]):
    """Everything that a resumed run needs; host arrays are written in place."""

    sac: SACState
    replay: Replay
    world: World  # what is known of the robots beside their physics
    physics: Float[np.ndarray, "robot state"]
    iteration: Int[np.ndarray, ""]


@dataclass(frozen=True)
class Learner(ABC, Generic[World]):
    """What a kind of policy fills in; its fields stay as they are throughout a run."""

    name: ClassVar[str]
    spec: RobotSpec
    config: OffPolicyConfig

    def simulate(self, size: int) -> RobotBatch:
        """The robots that it moves."""
        return RobotBatch(self.spec, size)

    @abstractmethod
    def sizes(self, batch: RobotBatch) -> tuple[int, int]:
        """Numbers that the policy sees, and numbers of an action."""

    @abstractmethod
    def begin(self, batch: RobotBatch, actor: Actor, key: PRNGKeyArray) -> World:
        """What is known of robots that have not moved yet."""

    @abstractmethod
    def collect(
        self, state: OffPolicyState[World], batch: RobotBatch, rng: np.random.Generator, key: PRNGKeyArray
    ) -> tuple[World, dict[str, Any]]:
        """Move robots by `config.steps`, append to the replay buffer; returns the world then, and what was earned."""

    @abstractmethod
    def measure(self, actor: Actor) -> dict[str, float]:
        """Figures of the policy on held-out tasks."""

    @abstractmethod
    def save(self, actor: Actor, figures: dict[str, float], run: Run) -> Path:
        """Write artifact and card; the artifact's folder."""

    @abstractmethod
    def load_actor(self, artifact: str) -> Actor:
        """The trained actor of an artifact of this kind."""

    def row(self, batch: RobotBatch) -> Any:
        """A row of the replay buffer, whatever its numbers: a transition as it is learned from."""
        features, actions = self.sizes(batch)
        seen, scalar = np.zeros((1, features), np.float32), np.zeros(1, np.float32)
        return SACBatch(seen, np.zeros((1, actions), np.float32), scalar, seen, scalar)

    def update(self, policy: SACState, drawn: Any, key: PRNGKeyArray, iteration: int) -> tuple[SACState, dict]:
        """An update of the policy for each batch of the rows that were drawn."""
        return learn(policy, drawn, key, self.config.sac)


def iterate(state: OffPolicyState, learner: Learner, batch: RobotBatch, seed: int) -> tuple[OffPolicyState, Metrics]:
    """One turn of the loop."""
    iteration, config = int(state.iteration), learner.config
    rng = np.random.default_rng((seed, 2, iteration))
    collect_key, learn_key = jax.random.split(jax.random.fold_in(jax.random.key(seed), iteration))

    world, earned = learner.collect(state, batch, rng, collect_key)
    drawn = state.replay.draw((config.updates, config.sac.batch_size), rng)
    policy, learned = learner.update(state.sac, drawn, learn_key, iteration)
    state = OffPolicyState(policy, state.replay, world, batch.state, np.asarray(iteration + 1))
    return state, measured(
        learned | earned, iteration, config.evaluate_every, lambda: learner.measure(policy.averaged_actor)
    )


def train(
    learner: Learner, out: Path, settings: dict[str, Any], *, resume: bool, finish: bool, init_from: str | None
) -> Path:
    """Train from the beginning, or go on with the run in `out`; returns the artifact's folder.

    `settings` are those that the run is known by beside its configuration, its seed among them.
    """
    config, seed = learner.config, settings["seed"]
    with Run(out, asdict(config) | settings | {"init_from": init_from}, resume=resume, finish=finish) as run:
        batch = learner.simulate(config.robots)
        batch.reset(np.random.default_rng((seed, 1)))
        state = run.restore(initial_state(learner, batch, jax.random.key(seed), init_from))
        batch.state = state.physics
        state = run.loop(state, lambda state: iterate(state, learner, batch, seed), config.iterations, learner.name)
        actor = state.sac.averaged_actor
        return learner.save(actor, learner.measure(actor), run)


def initial_state(
    learner: Learner[World], batch: RobotBatch, key: PRNGKeyArray, init_from: str | None = None
) -> OffPolicyState[World]:
    """Robots that have not moved, an empty replay buffer, a fresh policy or that of an artifact."""
    policy = sac.initial_state(*learner.sizes(batch), learner.config.sac, key)
    if init_from is not None:
        policy = sac.take_over(policy, learner.load_actor(init_from), init_from)
    return OffPolicyState(
        sac=policy,
        replay=Replay.empty(learner.config.replay, learner.row(batch)),
        world=learner.begin(batch, policy.actor, key),
        physics=batch.state,
        iteration=np.zeros((), np.int64),
    )


def ready_robot(robot: str, config: Any) -> RobotSpec:
    """The robot of a run; RebodyError if it is not ready, or a setting lies outside of its range."""
    check_ranges(config)
    spec = load_robot(robot)
    require_ready(spec)
    return spec


def as_stored(rows: SACBatch, _: PRNGKeyArray) -> SACBatch:
    """The batch that rows are where nothing is to be changed."""
    return rows


@eqx.filter_jit
def learn(
    policy: SACState,
    drawn: Any,
    key: PRNGKeyArray,
    config: SACConfig,
    batch_of: Callable[[Any, PRNGKeyArray], SACBatch] = as_stored,
    action_value: ActionValue = value_of_action,
) -> tuple[SACState, dict[str, Float[AnyArray, ""]]]:
    """An update of soft actor-critic for each batch that `batch_of` makes of rows; they have the update first."""
    keys = jax.random.split(key, len(jax.tree.leaves(drawn)[0]))
    return sac.update_many(policy, batch_of, drawn, keys, config, action_value)


@eqx.filter_jit
def explore(actor: Actor, observation: Float[AnyArray, "robot feature"], key: PRNGKeyArray):
    """A sample of what the policy does."""
    return actor.sample(observation, key)[0]
