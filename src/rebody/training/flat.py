"""Training a flat policy with soft actor-critic: the frozen module believes, the policy moves the joints.

It is paid as a tracker would be that was told the hidden task; all it hears of the task itself is what
the module makes of the rewards (thesis 6.3.2).
"""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import jax
import numpy as np
from jaxtyping import Float, PRNGKeyArray

from rebody.agents.build import build_agent
from rebody.agents.configs import FlatSettings
from rebody.agents.controller import FlatController
from rebody.agents.parts import Inference, load_flat, load_inference
from rebody.bodies import RobotBatch
from rebody.control.command import commands_within
from rebody.control.flat import FlatPolicy, FlatView
from rebody.control.sac import Actor, SACBatch, SACConfig
from rebody.control.tracker import TrackerReward
from rebody.errors import RebodyError
from rebody.jax_settings import own_jax_settings
from rebody.ranges import Decisions
from rebody.store import tree_hash
from rebody.tasks import SHIPPED, FamilySet
from rebody.training.card import save
from rebody.training.held_out import act, figures_of, rows_of
from rebody.training.motion import privileged_reward, put_on_feet
from rebody.training.off_policy import Learner, OffPolicyConfig, OffPolicyState, explore, ready_robot, train
from rebody.training.run import Metrics, Run
from rebody.training.task_inference import TaskInference, begin_tasks, infer, tasks_within
from rebody.types import Belief


@dataclass(frozen=True, kw_only=True)
class FlatConfig(OffPolicyConfig):
    """One training run of a flat policy; robots, steps and updates are a tracker's."""

    decisions: Decisions = 200
    """Length of an episode: 20 s, as long as it will be used."""
    reward: TrackerReward = field(default_factory=TrackerReward)
    """What the policy is paid: as a tracker that is told the hidden task."""
    sac: SACConfig = field(default_factory=lambda: SACConfig(projections=8, decay_updates=180_000))
    """Hyperparameters of soft actor-critic."""


@own_jax_settings()
def train_flat(
    robot: str,
    inference: str,
    config: FlatConfig,
    out: Path,
    seed: int,
    *,
    resume: bool = False,
    finish: bool = False,
    init_from: str | None = None,
) -> Path:
    """Train a flat policy; returns the artifact's folder.

    RebodyError if the robot is not ready, `out` holds another run, or module and robot do not fit; Interrupted on
    Ctrl-C.
    """
    spec, module = ready_robot(robot, config), load_inference(inference)
    if config.steps < spec.steps_per_decision:
        raise RebodyError(f"--steps must be at least the {spec.steps_per_decision} control steps of a decision.")
    module.contract.check_body(spec.name, spec.moving_fields, [name for name, _ in spec.reach])
    settings = {"robot": robot, "inference": inference, "seed": seed}
    learner = FlatLearner(spec, config, module)
    return train(learner, out, settings, resume=resume, finish=finish, init_from=init_from)


@dataclass(frozen=True)
class FlatLearner(Learner[TaskInference]):
    """(joint state, x, belief) -> joint action."""

    name = "flat"
    config: FlatConfig
    module: Inference

    def sizes(self, batch: RobotBatch) -> tuple[int, int]:
        """Those of the robot's joints and the module's beliefs."""
        latent = self.module.parts.module.encoder.latent
        return self.view.size(batch.joint_state().shape[-1], latent), self.spec.model.nu

    def begin(self, batch: RobotBatch, actor: Actor, key: PRNGKeyArray) -> TaskInference:
        """Robots that know nothing."""
        return begin_tasks(batch, self.module, key)

    def collect(
        self, state: OffPolicyState[TaskInference], batch: RobotBatch, rng: np.random.Generator, key: PRNGKeyArray
    ) -> tuple[TaskInference, Metrics]:
        """Control steps; the mean reward that the task gave per decision."""
        module, per_decision, rewards, known = self.module, self.spec.steps_per_decision, [], state.world
        encoder, families = module.parts.module.encoder, module.contract.families
        first = int(state.iteration) * self.config.steps
        for step in range(first, first + self.config.steps):
            task_key, action_key = jax.random.split(jax.random.fold_in(key, step - first))
            if step % (self.config.decisions * per_decision) == 0:
                batch.reset(rng)
                known = begin_tasks(batch, module, task_key)
            observation, before = self.observe(batch, known.belief), batch.pose()
            action = np.asarray(explore(state.sac.actor, observation, action_key))
            batch.step(action)
            paid = privileged_reward(batch, before, known.task, action, families, self.commands, self.config.reward)
            if (step + 1) % per_decision == 0:
                known, earned = infer(encoder, known, batch.observe(), families)
                rewards.append(np.mean(earned))
            seen = SACBatch(
                observation=observation,
                action=action,
                reward=paid,
                next_observation=self.observe(batch, known.belief),
                terminal=np.zeros(batch.size, np.float32),  # what has fallen goes on
            )
            state.replay.append(seen)
            put_on_feet(batch, rng)
        return known, {"task_reward": float(np.mean(rewards))}

    def observe(self, batch: RobotBatch, belief: Belief) -> Float[np.ndarray, "robot feature"]:
        """What the flat policy sees of each robot."""
        interpreted = self.module.parts.module.decoder.interpret(belief)
        return np.asarray(self.view(batch.joint_state(), batch.pose().astype(np.float32), interpreted))

    @cached_property
    def commands(self) -> FamilySet:
        """What a tracker of the robot would be told."""
        return commands_within(self.spec.reach, self.module.contract.families.beside(SHIPPED))

    @cached_property
    def view(self) -> FlatView:
        """What the policy sees; x as a share of how far the module's tasks take a robot, where no places are said."""
        farthest = max(max(box.largest) for box in self.module.contract.families.ranges.values())
        return FlatView(self.module.places, farthest)

    def measure(self, actor: Actor) -> dict[str, float]:
        """Final error of each family, return, share that fell."""
        module, config = self.module, self.config
        controller = FlatController(FlatPolicy(actor, self.view), module.parts.module.decoder)
        agent, tasks = build_agent("flat", module), tasks_within(module, self.spec.reach)
        return figures_of(tasks, *act(agent, controller, self.spec, tasks, config.held_out, config.held_out_s))

    def save(self, actor: Actor, figures: dict[str, float], run: Run) -> Path:
        """A flat policy's artifact."""
        robot, module, config = self.spec.name, self.module, self.config
        settings = FlatSettings(
            robot=robot,
            inference=module.name,
            inference_hash=tree_hash(module.parts.module),
            reach=self.view.reach,
            places=self.view.places,
            observations=actor.observations,
            actions=actor.actions,
            hidden=config.sac.hidden,
            projections=config.sac.projections,
            training=run.training(config),
        )
        steps = run.iterations * config.steps * config.robots
        what = (
            f"Flat policy of '{robot}': (joint state, x, belief of '{module.name}') -> joint action, without "
            f"subgoals. Trained on {steps:,} control steps with {run.iterations * config.updates:,} updates."
        )
        rows = rows_of(self.module.contract.families, figures, config.held_out, config.held_out_s)
        return save("flat", settings, FlatPolicy(actor, self.view), run, f"Flat policy: {robot}", what, rows)

    def load_actor(self, artifact: str) -> Actor:
        """That of a flat policy."""
        return load_flat(artifact).policy.actor
