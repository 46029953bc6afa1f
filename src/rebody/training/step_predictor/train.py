"""Training a step predictor with soft actor-critic (thesis 6.4.3).

A step of its decision process is a subgoal: the predictor says how many control steps it will take, the frozen tracker
follows it for so long, then the next one is given. Every robot has its own number of steps left.
"""

from dataclasses import asdict
from pathlib import Path

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Float, Int, PRNGKeyArray

from rebody.agents.build import check_robot_of
from rebody.agents.parts import LoadedTracker, load_step_predictor, load_tracker
from rebody.bodies import RobotBatch, load_robot
from rebody.bodies.check import require_ready
from rebody.control import sac
from rebody.control.sac import SACBatch, SACState
from rebody.control.step_predictor import MOST_STEPS, StepPredictor, steps_of
from rebody.control.tracker import Command, Tracker, tracker_observation
from rebody.errors import RebodyError
from rebody.jax_settings import own_jax_settings
from rebody.ranges import check_ranges
from rebody.training.ring import draw, newest, write
from rebody.training.run import Metrics, Run
from rebody.training.step_predictor.chase import World, advance, begin
from rebody.training.step_predictor.choosers import Deciding, Exploring
from rebody.training.step_predictor.config import StepPredictorConfig
from rebody.training.step_predictor.report import measure, save_step_predictor
from rebody.training.transitions import learn, no_transitions


class RunState(eqx.Module):
    """Everything that a resumed run needs; host arrays are written in place."""

    sac: SACState
    replay: SACBatch  # a ring with a row per subgoal
    written: Int[np.ndarray, ""]  # rows ever
    world: World
    physics: Float[np.ndarray, "robot state"]
    iteration: Int[np.ndarray, ""]


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
    check_ranges(config)
    if config.steps < MOST_STEPS:
        raise RebodyError(f"--steps must be at least {MOST_STEPS}: so long can a subgoal be held.")
    spec = load_robot(robot)
    require_ready(spec)
    loaded = load_tracker(f"tracker-{spec.name}" if tracker is None else tracker)
    check_robot_of(loaded, spec)
    settings = {"robot": robot, "tracker": tracker, "seed": seed, "init_from": init_from}
    with Run(out, asdict(config) | settings, resume=resume, finish=finish) as run:
        batch = RobotBatch(spec, config.robots)
        batch.reset(np.random.default_rng((seed, 1)))
        state = run.restore(initial_state(config, batch, loaded.tracker, jax.random.key(seed), init_from))
        batch.state = state.physics
        state = run.loop(
            state,
            lambda state: iterate(state, batch, loaded.tracker, config, seed),
            config.iterations,
            "step predictor",
        )
        return save_step_predictor(_predictor(state, loaded), loaded, spec, config, run, seed)


def iterate(
    state: RunState, batch: RobotBatch, tracker: Tracker, config: StepPredictorConfig, seed: int
) -> tuple[RunState, Metrics]:
    """Move the robots, learn from the replay, now and then evaluate."""
    iteration, written = int(state.iteration), int(state.written)
    rng = np.random.default_rng((seed, 2, iteration))
    collect_key, learn_key = jax.random.split(jax.random.fold_in(jax.random.key(seed), iteration))
    collect(state, batch, tracker, config, rng, collect_key)
    transitions = draw(state.replay, int(state.written), (config.updates, config.sac.batch_size), rng)
    policy, metrics = learn(state.sac, transitions, learn_key, config.sac)
    metrics |= experience(newest(state.replay, int(state.written), int(state.written) - written))
    state = eqx.tree_at(
        lambda s: (s.sac, s.physics, s.iteration),
        state,
        (policy, batch.state, state.iteration + 1),
    )
    if (iteration + 1) % config.evaluate_every == 0:
        figures = measure(Deciding(state.sac.averaged_actor), tracker, batch.spec, config)
        metrics |= {f"evaluation/{name}": value for name, value in figures.items()}
    return state, {name: float(value) for name, value in metrics.items()}


def collect(
    state: RunState,
    batch: RobotBatch,
    tracker: Tracker,
    config: StepPredictorConfig,
    rng: np.random.Generator,
    key: PRNGKeyArray,
) -> None:
    """Move every robot by `config.steps` control steps; write the replay in place."""
    chooser = Exploring(state.sac.actor)
    for step in range(config.steps):
        transitions = advance(state.world, batch, tracker, chooser, config, rng, jax.random.fold_in(key, step))
        write(state.replay, int(state.written), transitions)
        state.written[...] += len(transitions.reward)


def experience(seen: SACBatch) -> Metrics:
    """Of the newest subgoals: what they earned, how long they were held, how many ended in a fall."""
    return {
        "reward": float(np.mean(seen.reward)),
        "steps": float(np.mean(steps_of(seen.action))),
        "falls": float(np.mean(seen.terminal)),
    }


def initial_state(
    config: StepPredictorConfig, batch: RobotBatch, tracker: Tracker, key: PRNGKeyArray, init_from: str | None = None
) -> RunState:
    """Robots with a first subgoal, an empty replay, a fresh policy or that of an artifact."""
    nothing = Command(np.zeros(batch.size, np.int32), np.zeros(batch.size, np.float32))
    features = tracker_observation(batch.tracker_state(), nothing, tracker.reach).shape[-1]
    policy = sac.initial_state(features, 1, config.sac, key)
    if init_from is not None:
        policy = sac.take_over(policy, load_step_predictor(init_from).predictor.actor, init_from)
    return RunState(
        sac=policy,
        replay=no_transitions(config.replay, features, 1),
        written=np.zeros((), np.int64),
        world=begin(batch, tracker.reach, Exploring(policy.actor), config, key),
        physics=batch.state,
        iteration=np.zeros((), np.int64),
    )


def _predictor(state: RunState, loaded: LoadedTracker) -> StepPredictor:
    return StepPredictor(state.sac.averaged_actor, loaded.tracker.reach)
