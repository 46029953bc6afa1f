"""What a step predictor earns beside fixed strides, and the artifact that it leaves behind."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from rebody.agents.configs import StepPredictorSettings
from rebody.agents.parts import LoadedTracker
from rebody.bodies import RobotBatch, RobotSpec
from rebody.control.sac import SACBatch
from rebody.control.step_predictor import MOST_STEPS, SLOTS, STEP_COST, StepPredictor, steps_of
from rebody.control.tracker import Tracker
from rebody.store import tree_hash
from rebody.tasks import FAMILIES
from rebody.training.card import save
from rebody.training.run import Run
from rebody.training.step_predictor.chase import advance, begin
from rebody.training.step_predictor.choosers import Chooser, Fixed
from rebody.training.step_predictor.config import StepPredictorConfig

STRIDES = (1, 2, 5, 10)
"""Fixed numbers of control steps that it is compared with."""


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
    slots = seen.observation[:, batch.tracker_state().shape[-1] :]  # one-hot, then the values
    for slot in SLOTS:
        figures[f"control steps, {FAMILIES[slot].name}"] = np.mean(steps[slots[:, slot] == 1])
    return {name: float(value) for name, value in figures.items()}


def chase(chooser: Chooser, batch: RobotBatch, tracker: Tracker, config: StepPredictorConfig) -> SACBatch:
    """Every subgoal that ended while robots chased toys, from their rest pose on."""
    rng, key = np.random.default_rng(2**31 - 1), jax.random.key(2**31 - 1)
    batch.reset(rng)
    world = begin(batch, tracker.reach, chooser, config, key)
    ended = [
        advance(world, batch, tracker, chooser, config, rng, jax.random.fold_in(key, step))
        for step in range(round(config.held_out_s / batch.spec.control_dt))
    ]
    return jax.tree.map(lambda *leaves: np.concatenate(leaves), *ended)


def save_step_predictor(
    predictor: StepPredictor,
    figures: dict[str, float],
    loaded: LoadedTracker,
    spec: RobotSpec,
    config: StepPredictorConfig,
    run: Run,
) -> Path:
    """Measure fixed strides beside it, write artifact and card."""
    actor = predictor.actor
    settings = StepPredictorSettings(
        robot=spec.name,
        tracker=loaded.name,
        tracker_hash=tree_hash(loaded.tracker),
        reach=predictor.reach,
        observations=actor.observations,
        hidden=config.sac.hidden,
        projections=config.sac.projections,
        training=run.training(config),
    )
    rows = {f"{name}, predicted": f"{value:.3f}" for name, value in figures.items()}
    for stride in STRIDES:
        fixed = measure(Fixed(jnp.asarray(stride)), loaded.tracker, spec, config)
        rows |= {f"{name}, always {stride}": f"{fixed[name]:.3f}" for name in ("reward", "relative error")}
    steps = run.iterations * config.steps * config.robots
    what = (
        f"How many control steps a subgoal will take '{spec.name}' and '{loaded.name}': (joint state, subgoal) -> 1 to "
        f"{MOST_STEPS}. Trained on {steps:,} control steps with {run.iterations * config.updates:,} updates. The "
        f"figures are means over the subgoals of {config.held_out} robots that chase toys one decision ahead for "
        f"{config.held_out_s:g} s."
    )
    return save("step-predictor", settings, predictor, run, f"Step predictor: {spec.name}", what, rows)
