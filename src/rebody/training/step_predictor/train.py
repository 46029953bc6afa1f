"""Training a step predictor with soft actor-critic (thesis 6.4.3).

A step of its decision process is a subgoal: the predictor says how many control steps it will take, the frozen tracker
follows it for so long, then the next one is given. Every robot has its own number of steps left.
"""

from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np
from jaxtyping import PRNGKeyArray

from rebody.agents.build import check_robot_of
from rebody.agents.parts import LoadedTracker, load_step_predictor, load_tracker
from rebody.bodies import RobotBatch
from rebody.control.sac import Actor, SACBatch
from rebody.control.step_predictor import MOST_STEPS, StepPredictor, steps_of
from rebody.errors import RebodyError
from rebody.jax_settings import own_jax_settings
from rebody.training.motion import tracker_features
from rebody.training.off_policy import Learner, OffPolicyState, ready_robot, train
from rebody.training.run import Metrics, Run
from rebody.training.step_predictor.chase import World, advance, begin
from rebody.training.step_predictor.choosers import Deciding, Exploring
from rebody.training.step_predictor.config import StepPredictorConfig
from rebody.training.step_predictor.report import measure, save_step_predictor


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
    settings = {"robot": robot, "tracker": tracker, "seed": seed}
    learner = StepPredictorLearner(spec, config, loaded)
    return train(learner, out, settings, resume=resume, finish=finish, init_from=init_from)


@dataclass(frozen=True)
class StepPredictorLearner(Learner[World]):
    """(joint state, subgoal) -> how many control steps it will take a frozen tracker."""

    name = "step predictor"
    config: StepPredictorConfig
    tracker: LoadedTracker

    def sizes(self, batch: RobotBatch) -> tuple[int, int]:
        """Those that the tracker sees, and one number."""
        return tracker_features(batch, self.tracker.tracker.reach), 1

    def begin(self, batch: RobotBatch, actor: Actor, key: PRNGKeyArray) -> World:
        """Robots with a first subgoal."""
        return begin(batch, self.tracker.tracker.reach, Exploring(actor), self.config, key)

    def collect(
        self, state: OffPolicyState[World], batch: RobotBatch, rng: np.random.Generator, key: PRNGKeyArray
    ) -> tuple[World, Metrics]:
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
        """A step predictor's artifact."""
        predictor = StepPredictor(actor, self.tracker.tracker.reach)
        return save_step_predictor(predictor, figures, self.tracker, self.spec, self.config, run)

    def load_actor(self, artifact: str) -> Actor:
        """That of a step predictor."""
        return load_step_predictor(artifact).predictor.actor
