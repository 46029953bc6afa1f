"""Training a step predictor with soft actor-critic (thesis 6.4.3).

A step of its decision process is a subgoal: the predictor says how many control steps it will take, the frozen tracker
follows it for so long, then the next one is given. Every robot has its own number of steps left.
"""

from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PRNGKeyArray

from rebody.agents.build import check_robot_of
from rebody.agents.configs import StepPredictorSettings
from rebody.agents.parts import LoadedTracker, load_step_predictor, load_tracker
from rebody.bodies import RobotBatch, RobotSpec
from rebody.control.sac import Actor, SACBatch
from rebody.control.step_predictor import MOST_STEPS, STEP_COST, StepPredictor, is_predictable, steps_of
from rebody.control.tracker import Tracker
from rebody.errors import RebodyError
from rebody.jax_settings import own_jax_settings
from rebody.store import tree_hash
from rebody.training.card import save
from rebody.training.motion import tracker_features
from rebody.training.off_policy import Learner, OffPolicyState, ready_robot, train
from rebody.training.run import Metrics, Run
from rebody.training.step_predictor.chase import Chase, Chooser, Deciding, Exploring, Fixed, advance, begin, predictable
from rebody.training.step_predictor.config import StepPredictorConfig

STRIDES = (1, 2, 5, 10)
"""Fixed numbers of control steps that it is compared with."""


@own_jax_settings()
def train_step_predictor(
    robot: str,
    tracker: str | None,
    config: StepPredictorConfig,
    out: Path,
    seed: int,
    *,
    resume: bool = False,
    finish: bool = False,
    init_from: str | None = None,
) -> Path:
    """Train a step predictor for a tracker, by default `tracker-ROBOT`; returns the artifact's folder.

    RebodyError if the robot is not ready, `out` holds another run, or robot, tracker and `init_from` do not fit;
    Interrupted on Ctrl-C.
    """
    spec = ready_robot(robot, config)
    if config.steps < MOST_STEPS:
        raise RebodyError(f"--steps must be at least {MOST_STEPS}: so long can a subgoal be held.")
    loaded = load_tracker(f"tracker-{spec.name}" if tracker is None else tracker)
    check_robot_of(loaded, spec)
    if not any(map(is_predictable, loaded.tracker.families)):
        raise RebodyError(
            f"'{loaded.name}' is told neither places nor speeds along x: there are no strides to predict."
        )
    settings = {"robot": robot, "tracker": tracker, "seed": seed}
    learner = StepPredictorLearner(spec, config, loaded)
    return train(learner, out, settings, resume=resume, finish=finish, init_from=init_from)


@dataclass(frozen=True)
class StepPredictorLearner(Learner[Chase]):
    """(joint state, subgoal) -> how many control steps it will take a frozen tracker."""

    name = "step predictor"
    config: StepPredictorConfig
    tracker: LoadedTracker

    def sizes(self, batch: RobotBatch) -> tuple[int, int]:
        """Those that the tracker sees, and one number."""
        return tracker_features(batch, self.tracker.tracker.families), 1

    def begin(self, batch: RobotBatch, actor: Actor, key: PRNGKeyArray) -> Chase:
        """Robots with a first subgoal."""
        return begin(batch, self.tracker.tracker.families, Exploring(actor), self.config, key)

    def collect(
        self, state: OffPolicyState[Chase], batch: RobotBatch, rng: np.random.Generator, key: PRNGKeyArray
    ) -> tuple[Chase, Metrics]:
        """Control steps; what the subgoals that ended earned, how long they were held, how many ended in a fall."""
        chooser, before = Exploring(state.sac.actor), int(state.replay.written)
        for step in range(self.config.steps):
            step_key = jax.random.fold_in(key, step)
            ended = advance(state.world, batch, self.tracker.tracker, chooser, self.config, rng, step_key)
            state.replay.append(ended)
        seen: SACBatch = state.replay.newest(int(state.replay.written) - before)
        return state.world, {
            "reward": float(np.mean(seen.reward)),
            "steps": float(np.mean(steps_of(seen.action))),
            "falls": float(np.mean(seen.terminal)),
        }

    def measure(self, actor: Actor) -> dict[str, float]:
        """What subgoals earn, falls."""
        return measure(Deciding(actor), self.tracker.tracker, self.spec, self.config)

    def save(self, actor: Actor, figures: dict[str, float], run: Run) -> Path:
        """A step predictor's artifact; fixed strides are measured beside it."""
        robot, tracker, config = self.spec.name, self.tracker, self.config
        predictor = StepPredictor(actor, tracker.tracker.families)
        settings = StepPredictorSettings(
            robot=robot,
            tracker=tracker.name,
            tracker_hash=tree_hash(tracker.tracker),
            families=predictor.families,
            observations=actor.observations,
            hidden=config.sac.hidden,
            projections=config.sac.projections,
            training=run.training(config),
        )
        rows = {f"{name}, predicted": f"{value:.3f}" for name, value in figures.items()}
        for stride in STRIDES:
            fixed = measure(Fixed(jnp.asarray(stride)), tracker.tracker, self.spec, config)
            rows |= {f"{name}, always {stride}": f"{fixed[name]:.3f}" for name in ("reward", "relative error")}
        steps = run.iterations * config.steps * config.robots
        what = (
            f"How many control steps a subgoal will take '{robot}' and '{tracker.name}': (joint state, subgoal) -> 1 "
            f"to {MOST_STEPS}. Trained on {steps:,} control steps with {run.iterations * config.updates:,} updates. "
            f"The figures are means over the subgoals of {config.held_out} robots that chase toys one decision ahead "
            f"for {config.held_out_s:g} s."
        )
        return save("step-predictor", settings, predictor, run, f"Step predictor: {robot}", what, rows)

    def load_actor(self, artifact: str) -> Actor:
        """That of a step predictor."""
        return load_step_predictor(artifact).predictor.actor


def measure(chooser: Chooser, tracker: Tracker, spec: RobotSpec, config: StepPredictorConfig) -> dict[str, float]:
    """Means over the subgoals of held-out chases, the error relative to the subgoal; falls per minute of a robot."""
    batch = RobotBatch(spec, config.held_out)
    seen = chase(chooser, batch, tracker, config)
    steps = np.asarray(steps_of(seen.action))
    stood = seen.terminal == 0
    figures = {
        "reward": np.mean(seen.reward),
        "relative error": np.mean((-seen.reward - STEP_COST * steps)[stood]),
        "falls per minute": 60 * np.sum(seen.terminal) / (config.held_out * config.held_out_s),
    }
    slots = seen.observation[:, batch.proprioception().shape[-1] :]  # one-hot, then the values
    for name in predictable(tracker.families).names:
        figures[f"control steps, {name}"] = np.mean(steps[slots[:, tracker.families.index(name)] == 1])
    return {name: float(value) for name, value in figures.items()}


def chase(chooser: Chooser, batch: RobotBatch, tracker: Tracker, config: StepPredictorConfig) -> SACBatch:
    """Every subgoal that ended while robots chased toys, from their rest pose on."""
    rng, key = np.random.default_rng(2**31 - 1), jax.random.key(2**31 - 1)
    batch.reset(rng)
    chased = begin(batch, tracker.families, chooser, config, key)
    ended = [
        advance(chased, batch, tracker, chooser, config, rng, jax.random.fold_in(key, step))
        for step in range(round(config.held_out_s / batch.spec.control_dt))
    ]
    return jax.tree.map(lambda *leaves: np.concatenate(leaves), *ended)
