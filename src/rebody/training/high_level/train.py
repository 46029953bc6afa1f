"""Training a robot's high-level policy with soft actor-critic (thesis 5.6.2, 6.5).

The module that believes and the tracker that moves the joints are frozen; what is learned is which subgoal a belief
asks for. A step of its decision process is a decision of 0.1 s, its reward the task's own: nobody tells it the task.
"""

from dataclasses import asdict, dataclass
from pathlib import Path

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Bool, Float, Int, PRNGKeyArray

from rebody.agents.build import check_robot_of
from rebody.agents.controller import TrackerController
from rebody.agents.parts import Inference, LoadedTracker, load_high_level, load_inference, load_tracker
from rebody.agents.rollout import follow
from rebody.bodies import RobotBatch, RobotSpec, load_robot
from rebody.bodies.check import require_ready
from rebody.control import sac
from rebody.control.sac import Actor, SACBatch, SACState
from rebody.control.slot_policy import SlotPolicy, Slots, draw, judge, slot_sac, slots_within, subgoal_of
from rebody.jax_settings import own_jax_settings
from rebody.ranges import check_ranges
from rebody.training.arrival import arrival_bonus
from rebody.training.high_level.config import HighLevelConfig
from rebody.training.high_level.report import measure, save_high_level
from rebody.training.minds import Minds, listen, new_minds, put_on_feet
from rebody.training.ring import draw as draw_rows
from rebody.training.ring import write
from rebody.training.run import Metrics, Run
from rebody.training.transitions import learn, no_transitions
from rebody.types import AnyArray, GlobalState, Subgoal


@dataclass(frozen=True)
class Frozen:
    """What does not learn."""

    module: Inference
    controller: TrackerController
    slots: Slots


class RunState(eqx.Module):
    """Everything that a resumed run needs; host arrays are written in place."""

    sac: SACState
    replay: SACBatch  # a ring of decisions in host memory, written in place
    minds: Minds
    physics: Float[np.ndarray, "robot state"]
    iteration: Int[np.ndarray, ""]


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
    check_ranges(config)
    spec, module = load_robot(robot), load_inference(inference)
    require_ready(spec)
    loaded = load_tracker(f"tracker-{spec.name}" if tracker is None else tracker)
    check_robot_of(loaded, spec)
    module.contract.check_body(spec.name, spec.moving_fields, loaded.tracker.slots)
    settings = {"robot": robot, "inference": inference, "tracker": tracker, "seed": seed, "init_from": init_from}
    with Run(out, asdict(config) | settings, resume=resume, finish=finish) as run:
        batch, frozen = RobotBatch(spec, config.robots), freeze(module, loaded, spec)
        batch.reset(np.random.default_rng((seed, 1)))
        state = run.restore(initial_state(config, batch, frozen, jax.random.key(seed), init_from))
        batch.state = state.physics
        state = run.loop(
            state, lambda state: iterate(state, batch, frozen, config, seed), config.iterations, "high level"
        )
        return save_high_level(slot_policy(state, frozen), module, loaded, spec, config, run, seed)


def iterate(
    state: RunState, batch: RobotBatch, frozen: Frozen, config: HighLevelConfig, seed: int
) -> tuple[RunState, Metrics]:
    """Move the robots, learn from the replay, now and then evaluate."""
    iteration = int(state.iteration)
    rng = np.random.default_rng((seed, 2, iteration))
    collect_key, learn_key = jax.random.split(jax.random.fold_in(jax.random.key(seed), iteration))
    minds, metrics = collect(state, batch, frozen, config, rng, collect_key)
    written = (iteration + 1) * config.steps * config.robots
    transitions = draw_rows(state.replay, written, (config.updates, config.sac.batch_size), rng)
    policy, learned = learn(state.sac, transitions, learn_key, slot_sac(config.sac, len(frozen.slots)), judge)
    state = eqx.tree_at(
        lambda s: (s.sac, s.minds, s.physics, s.iteration),
        state,
        (policy, minds, batch.state, state.iteration + 1),
    )
    metrics |= learned
    if (iteration + 1) % config.evaluate_every == 0:
        figures = measure(slot_policy(state, frozen), frozen.module, frozen.controller, batch.spec)
        metrics |= {f"evaluation/{name}": value for name, value in figures.items()}
    return state, {name: float(value) for name, value in metrics.items()}


def collect(
    state: RunState,
    batch: RobotBatch,
    frozen: Frozen,
    config: HighLevelConfig,
    rng: np.random.Generator,
    key: PRNGKeyArray,
) -> tuple[Minds, Metrics]:
    """Move every robot by `config.steps` decisions; write the replay in place.

    Returns the minds afterwards, and the mean reward that the task gave per decision, with the share that ended in a
    fall.
    """
    spec, minds, module, rewards, falls = batch.spec, state.minds, frozen.module, [], []
    encoder = module.parts.module.encoder
    first = int(state.iteration) * config.steps
    for step in range(first, first + config.steps):
        task_key, action_key = jax.random.split(jax.random.fold_in(key, step - first))
        if step % config.decisions == 0:
            batch.reset(rng)
            minds = new_minds(batch, module, task_key)
        observation = observe(minds, module)
        action, subgoal = _explore(state.sac.actor, observation, minds.state, frozen.slots, action_key)
        before = batch.qpos.copy()
        fell = hold(batch, frozen.controller, subgoal)
        minds, earned = listen(encoder, minds, spec.observe(batch.qpos, before), module.contract.reward)
        seen = SACBatch(
            observation=np.asarray(observation),
            action=np.asarray(action),
            reward=shaped(np.asarray(earned) / encoder.reward_scale, fell, config),
            next_observation=np.asarray(observe(minds, module)),
            terminal=np.zeros(batch.size, np.float32),  # what has fallen goes on
        )
        write(state.replay, step * config.robots, seen)
        put_on_feet(batch, rng)
        rewards.append(earned)
        falls.append(fell)
    return minds, {"task_reward": float(np.mean(rewards)), "falls": float(np.mean(falls))}


def hold(batch: RobotBatch, controller: TrackerController, subgoal: Subgoal) -> Bool[np.ndarray, " robot"]:
    """Follow a subgoal for a decision; which robots fell."""
    fell = np.zeros(batch.size, bool)
    for _ in range(batch.spec.steps_per_decision):
        follow(controller, batch, subgoal)
        fell |= batch.fallen
    return fell


def shaped(
    earned: Float[np.ndarray, "*robot"], fell: Bool[np.ndarray, "*robot"], config: HighLevelConfig
) -> Float[np.ndarray, "*robot"]:
    """The task's scaled reward, a pull on arrival that is a function of it, a price for a fall."""
    arrival = arrival_bonus(earned, config.arrival, config.arrival_width)
    return np.asarray(earned + arrival - config.fall * fell, np.float32)


def observe(minds: Minds, module: Inference) -> Float[AnyArray, "robot feature"]:
    """What the policy sees of each robot: what the toy's policy would see of a toy."""
    return _view(module.parts.high_level.view, module.parts.module.decoder, minds)


def freeze(module: Inference, loaded: LoadedTracker, spec: RobotSpec) -> Frozen:
    """What does not learn, with a slot for each family that the module tells apart."""
    slots = slots_within(module.contract.families, loaded.tracker.reach)
    return Frozen(module, TrackerController(loaded.tracker, spec.goal_ahead), slots)


def initial_state(
    config: HighLevelConfig, batch: RobotBatch, frozen: Frozen, key: PRNGKeyArray, init_from: str | None = None
) -> RunState:
    """Robots that know nothing, an empty replay, a fresh policy or that of an artifact."""
    minds = new_minds(batch, frozen.module, key)
    features, actions = observe(minds, frozen.module).shape[-1], len(frozen.slots)
    policy = sac.initial_state(features, actions, config.sac, key)
    if init_from is not None:
        policy = sac.take_over(policy, load_high_level(init_from).policy.actor, init_from)
    return RunState(
        sac=policy,
        replay=no_transitions(config.replay, features, actions),
        minds=minds,
        physics=batch.state,
        iteration=np.zeros((), np.int64),
    )


def slot_policy(state: RunState, frozen: Frozen) -> SlotPolicy:
    """The averaged actor, with what it sees and what its values ask for."""
    return SlotPolicy(state.sac.averaged_actor, frozen.module.parts.high_level.view, frozen.slots)


@eqx.filter_jit
def _view(view, decoder, minds: Minds) -> Float[AnyArray, "robot feature"]:
    return view(minds.state, decoder.interpret(minds.belief))


@eqx.filter_jit
def _explore(actor: Actor, observation, state: GlobalState, slots: Slots, key: PRNGKeyArray):
    value_key, slot_key = jax.random.split(key)
    pooled = draw(actor.sample(observation, value_key)[0], slot_key)
    return pooled, subgoal_of(pooled, state, slots)
