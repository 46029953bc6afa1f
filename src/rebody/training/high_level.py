"""Training a robot's high-level policy with soft actor-critic (thesis 5.6.2, 6.5).

The module that believes and the tracker that moves the joints are frozen; what is learned is which subgoal a belief
asks for. A step of its decision process is a decision of 0.1 s, its reward the task's own: nobody tells it the task.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Bool, Float, PRNGKeyArray

from rebody.agents.build import build_agent, check_robot_of
from rebody.agents.configs import HighLevelSettings
from rebody.agents.controller import TrackerController
from rebody.agents.parts import Inference, LoadedTracker, load_high_level, load_inference, load_tracker
from rebody.agents.rollout import follow
from rebody.bodies import RobotBatch
from rebody.control.high_level import high_level_sac
from rebody.control.places import Places, numbers_of
from rebody.control.sac import Actor, SACBatch, SACConfig, SACState
from rebody.control.slot_policy import SlotPolicy, SlotValue, draw, slot_sac, slots_within, subgoal_of
from rebody.jax_settings import own_jax_settings
from rebody.ranges import Copies, Count, Decisions, NotNegative, Number, Positive, Rows
from rebody.store import tree_hash
from rebody.training.arrival import arrival_bonus
from rebody.training.card import save
from rebody.training.held_out import act, figures_of, rows_of
from rebody.training.motion import decision, put_on_feet
from rebody.training.off_policy import Learner, OffPolicyConfig, OffPolicyState, learn, ready_robot, train
from rebody.training.run import Metrics, Run
from rebody.training.task_inference import TaskInference, begin_tasks, infer, tasks_within
from rebody.types import AnyArray, GlobalState


@dataclass(frozen=True, kw_only=True)
class HighLevelConfig(OffPolicyConfig):
    """One training run of a high-level policy."""

    steps: Copies = 25
    """Decisions of each robot in an iteration."""
    updates: Count = 512
    """Updates in an iteration."""
    iterations: Number = 320
    """Length of the run."""
    evaluate_every: Count = 20
    """Iterations from one measurement on held-out tasks to the next."""
    replay: Rows = 512_000
    """Decisions kept: all of the run. Without its first ones, which tried everything, it gets worse again."""
    decisions: Decisions = 100
    """Length of an episode: 10 s."""
    arrival: NotNegative = 0.3
    """Added to the scaled reward r of a decision when r = 0: it pulls the last centimetres, and pays for a jump."""
    arrival_width: Positive = 0.1
    """Half of it is added at r = -arrival_width."""
    fall: NotNegative = 5.0
    """Taken from the reward of a decision in which the robot fell."""
    # with -1 in place of -2 nats values stay so uncertain that speeds are missed by three times as much
    sac: SACConfig = field(
        default_factory=lambda: replace(high_level_sac(projections=16, decay_updates=160_000), target_entropy=-2.0)
    )
    """Hyperparameters of soft actor-critic."""


@own_jax_settings()
def train_high_level(
    robot: str,
    inference: str,
    tracker: str | None,
    config: HighLevelConfig,
    out: Path,
    seed: int,
    *,
    resume: bool = False,
    finish: bool = False,
    init_from: str | None = None,
) -> Path:
    """Train a high-level policy for a tracker, by default `tracker-ROBOT`; returns the artifact's folder.

    RebodyError if the robot is not ready, `out` holds another run, or module, tracker and robot do not fit; Interrupted
    on Ctrl-C.
    """
    spec, module = ready_robot(robot, config), load_inference(inference)
    loaded = load_tracker(f"tracker-{spec.name}" if tracker is None else tracker)
    check_robot_of(loaded, spec)
    module.contract.check_body(spec.name, spec.moving_fields, loaded.tracker.families.names)
    settings = {"robot": robot, "inference": inference, "tracker": tracker, "seed": seed}
    learner = HighLevelLearner(spec, config, module, loaded)
    return train(learner, out, settings, resume=resume, finish=finish, init_from=init_from)


@dataclass(frozen=True)
class HighLevelLearner(Learner[TaskInference]):
    """(global state, belief) -> subgoal of a frozen tracker."""

    name = "high level"
    config: HighLevelConfig
    module: Inference
    tracker: LoadedTracker

    @cached_property
    def slots(self) -> Places:
        """One for each family that the module tells apart."""
        return slots_within(self.module.contract.families, self.tracker.tracker.families)

    @cached_property
    def controller(self) -> TrackerController:
        """What follows the subgoals."""
        return TrackerController(self.tracker.tracker, self.module.contract.families, self.spec.goal_ahead)

    def sizes(self, batch: RobotBatch) -> tuple[int, int]:
        """Those of the toy's policy, and the numbers of each slot."""
        parts = self.module.parts
        return self.module.view.size(parts.module.encoder.latent), numbers_of(self.slots)

    def begin(self, batch: RobotBatch, actor: Actor, key: PRNGKeyArray) -> TaskInference:
        """Robots that know nothing."""
        return begin_tasks(batch, self.module, key)

    def collect(
        self, state: OffPolicyState[TaskInference], batch: RobotBatch, rng: np.random.Generator, key: PRNGKeyArray
    ) -> tuple[TaskInference, Metrics]:
        """Decisions; the mean reward that the task gave, and the share that ended in a fall."""
        module, known, rewards, falls = self.module, state.world, [], []
        encoder = module.parts.module.encoder
        first = int(state.iteration) * self.config.steps
        for step in range(first, first + self.config.steps):
            task_key, action_key = jax.random.split(jax.random.fold_in(key, step - first))
            if step % self.config.decisions == 0:
                batch.reset(rng)
                known = begin_tasks(batch, module, task_key)
            observation = self.observe(known)
            action, subgoal = _explore(state.sac.actor, observation, known.state, self.slots, action_key)
            now, fell = decision(batch, lambda _: follow(self.controller, batch, subgoal))  # noqa: B023 (used at once)
            known, earned = infer(encoder, known, now, module.contract.families)
            seen = SACBatch(
                observation=np.asarray(observation),
                action=np.asarray(action),
                reward=shaped(np.asarray(earned) / encoder.reward_scale, fell, self.config),
                next_observation=np.asarray(self.observe(known)),
                terminal=np.zeros(batch.size, np.float32),  # what has fallen goes on
            )
            state.replay.append(seen)
            put_on_feet(batch, rng)
            rewards.append(earned)
            falls.append(fell)
        return known, {"task_reward": float(np.mean(rewards)), "falls": float(np.mean(falls))}

    def observe(self, known: TaskInference) -> Float[AnyArray, "robot feature"]:
        """What the policy sees of each robot: what the toy's policy would see of a toy."""
        parts = self.module.parts
        return _view(self.module.view, parts.module.decoder, known)

    def update(self, policy: SACState, drawn: Any, key: PRNGKeyArray, iteration: int) -> tuple[SACState, dict]:
        """Values are of the slot that is chosen in the end."""
        return learn(policy, drawn, key, slot_sac(self.config.sac, len(self.slots)), action_value=SlotValue(self.slots))

    def measure(self, actor: Actor) -> dict[str, float]:
        """Final error of each family, return, share that fell."""
        module, config = self.module, self.config
        agent = build_agent("retrain", module, high_level=self.policy(actor))
        tasks = tasks_within(module, self.spec.reach)
        return figures_of(tasks, *act(agent, self.controller, self.spec, tasks, config.held_out, config.held_out_s))

    def save(self, actor: Actor, figures: dict[str, float], run: Run) -> Path:
        """A high-level policy's artifact."""
        robot, module, tracker, config = self.spec.name, self.module, self.tracker, self.config
        settings = HighLevelSettings(
            robot=robot,
            inference=module.name,
            inference_hash=tree_hash(module.parts.module),
            tracker=tracker.name,
            tracker_hash=tree_hash(tracker.tracker),
            view=module.view,
            slots=self.slots,
            observations=actor.observations,
            hidden=config.sac.hidden,
            projections=config.sac.projections,
            training=run.training(config),
        )
        decisions = run.iterations * config.steps * config.robots
        what = (
            f"High-level policy of '{robot}': (global state, belief of '{module.name}') -> subgoal of "
            f"'{tracker.name}'. Trained on {decisions:,} decisions, which are "
            f"{decisions * self.spec.steps_per_decision:,} control steps, with "
            f"{run.iterations * config.updates:,} updates; module and tracker are frozen."
        )
        rows = rows_of(self.module.contract.families, figures, config.held_out, config.held_out_s)
        return save("high-level", settings, self.policy(actor), run, f"High-level policy: {robot}", what, rows)

    def load_actor(self, artifact: str) -> Actor:
        """That of a high-level policy."""
        return load_high_level(artifact).policy.actor

    def policy(self, actor: Actor) -> SlotPolicy:
        """An actor, with what it sees and what its values ask for."""
        return SlotPolicy(actor, self.module.view, self.slots)


def shaped(
    earned: Float[np.ndarray, "*robot"], fell: Bool[np.ndarray, "*robot"], config: HighLevelConfig
) -> Float[np.ndarray, "*robot"]:
    """The task's scaled reward, a pull on arrival that is a function of it, a price for a fall."""
    arrival = arrival_bonus(earned, config.arrival, config.arrival_width)
    return np.asarray(earned + arrival - config.fall * fell, np.float32)


@eqx.filter_jit
def _view(view, decoder, known: TaskInference) -> Float[AnyArray, "robot feature"]:
    return view(known.state, decoder.interpret(known.belief))


@eqx.filter_jit
def _explore(actor: Actor, observation, state: GlobalState, slots: Places, key: PRNGKeyArray):
    value_key, slot_key = jax.random.split(key)
    pooled = draw(actor.sample(observation, value_key)[0], slots, slot_key)
    return pooled, subgoal_of(pooled, state, slots)
