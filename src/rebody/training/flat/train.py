"""Training a flat policy with soft actor-critic: the frozen module believes, the policy moves the joints.

It is paid as a tracker would be that was told the hidden task; all it hears of the task itself is what
the module makes of the rewards (thesis 6.3.2).
"""

from dataclasses import asdict
from pathlib import Path

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Float, Int, PRNGKeyArray

from rebody.agents.parts import Inference, load_flat, load_inference
from rebody.bodies import RobotBatch, load_robot
from rebody.bodies.check import require_ready
from rebody.control import sac
from rebody.control.flat import FlatPolicy, FlatView
from rebody.control.sac import Actor, SACBatch, SACState
from rebody.control.tracker import slots_of
from rebody.errors import RebodyError
from rebody.jax_settings import own_jax_settings
from rebody.ranges import check_ranges
from rebody.training.flat.config import FlatConfig
from rebody.training.flat.report import measure, save_flat
from rebody.training.minds import Minds, listen, new_minds, put_on_feet
from rebody.training.motion import told_reward
from rebody.training.ring import draw, write
from rebody.training.run import Metrics, Run
from rebody.training.transitions import learn, no_transitions
from rebody.types import AnyArray, Belief


class RunState(eqx.Module):
    """Everything that a resumed run needs; host arrays are written in place."""

    sac: SACState
    replay: SACBatch  # a ring of control steps in host memory, written in place
    minds: Minds
    physics: Float[np.ndarray, "robot state"]
    previous_qpos: Float[np.ndarray, "robot nq"]  # at the last decision
    iteration: Int[np.ndarray, ""]


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
    check_ranges(config)
    spec, module = load_robot(robot), load_inference(inference)
    require_ready(spec)
    if config.steps < spec.steps_per_decision:
        raise RebodyError(f"--steps must be at least the {spec.steps_per_decision} control steps of a decision.")
    module.contract.check_body(spec.name, spec.moving_fields, slots_of(spec.reach))
    settings = {"robot": robot, "inference": inference, "seed": seed, "init_from": init_from}
    with Run(out, asdict(config) | settings, resume=resume, finish=finish) as run:
        batch = RobotBatch(spec, config.robots)
        batch.reset(np.random.default_rng((seed, 1)))
        state = run.restore(initial_state(config, batch, module, jax.random.key(seed), init_from))
        batch.state = state.physics
        state = run.loop(state, lambda state: iterate(state, batch, module, config, seed), config.iterations, "flat")
        return save_flat(flat_policy(state, module), module, spec, config, run, seed)


def iterate(
    state: RunState, batch: RobotBatch, module: Inference, config: FlatConfig, seed: int
) -> tuple[RunState, Metrics]:
    """Move the robots, learn from the replay, now and then evaluate."""
    iteration = int(state.iteration)
    rng = np.random.default_rng((seed, 2, iteration))
    collect_key, learn_key = jax.random.split(jax.random.fold_in(jax.random.key(seed), iteration))
    minds, earned = collect(state, batch, module, config, rng, collect_key)
    stored = (iteration + 1) * config.steps * config.robots
    transitions = draw(state.replay, stored, (config.updates, config.sac.batch_size), rng)
    policy, metrics = learn(state.sac, transitions, learn_key, config.sac)
    state = eqx.tree_at(
        lambda s: (s.sac, s.minds, s.physics, s.iteration),
        state,
        (policy, minds, batch.state, state.iteration + 1),
    )
    metrics |= {"task_reward": earned}
    if (iteration + 1) % config.evaluate_every == 0:
        figures = measure(flat_policy(state, module), module, batch.spec)
        metrics |= {f"evaluation/{name}": value for name, value in figures.items()}
    return state, {name: float(value) for name, value in metrics.items()}


def collect(
    state: RunState,
    batch: RobotBatch,
    module: Inference,
    config: FlatConfig,
    rng: np.random.Generator,
    key: PRNGKeyArray,
) -> tuple[Minds, float]:
    """Move every robot by `config.steps` control steps; write the replay in place.

    Returns the minds afterwards, and the mean reward that the task gave per decision.
    """
    spec, minds, rewards = batch.spec, state.minds, []
    first = int(state.iteration) * config.steps
    for step in range(first, first + config.steps):
        task_key, action_key = jax.random.split(jax.random.fold_in(key, step - first))
        if step % (config.decisions * spec.steps_per_decision) == 0:
            batch.reset(rng)
            minds = new_minds(batch, module, task_key)
            state.previous_qpos[:] = batch.qpos
        observation, before = observe(batch, minds.belief, module), batch.qpos.copy()
        action = np.asarray(_explore(state.sac.actor, observation, action_key))
        batch.step(action)
        if (step + 1) % spec.steps_per_decision == 0:
            now = spec.observe(batch.qpos, state.previous_qpos)
            minds, earned = listen(module.parts.module.encoder, minds, now, module.contract.reward)
            state.previous_qpos[:] = batch.qpos
            rewards.append(np.mean(earned))
        seen = SACBatch(
            observation=observation,
            action=action,
            reward=told_reward(batch, before, minds.task, action, config.reward),
            next_observation=observe(batch, minds.belief, module),
            terminal=np.zeros(batch.size, np.float32),  # what has fallen goes on
        )
        write(state.replay, step * config.robots, seen)
        put_on_feet(batch, rng)
    return minds, float(np.mean(rewards))


def observe(batch: RobotBatch, belief: Belief, module: Inference) -> Float[np.ndarray, "robot feature"]:
    """What the flat policy sees of each robot."""
    understood = module.parts.module.decoder.interpret(belief)
    return np.asarray(view(module)(batch.joint_state(), batch.x.astype(np.float32), understood))


def initial_state(
    config: FlatConfig, batch: RobotBatch, module: Inference, key: PRNGKeyArray, init_from: str | None = None
) -> RunState:
    """Robots that know nothing, an empty replay, a fresh policy or that of an artifact."""
    minds = new_minds(batch, module, key)
    features = observe(batch, minds.belief, module).shape[-1]
    actions = batch.spec.model.nu
    policy = sac.initial_state(features, actions, config.sac, key)
    if init_from is not None:
        policy = sac.take_over(policy, load_flat(init_from).policy.actor, init_from)
    return RunState(
        sac=policy,
        replay=no_transitions(config.replay, features, actions),
        minds=minds,
        physics=batch.state,
        previous_qpos=batch.qpos.copy(),
        iteration=np.zeros((), np.int64),
    )


def view(module: Inference) -> FlatView:
    """What the policy sees; x as a share of how far the module's tasks take a robot, where no places are said."""
    farthest = max(abs(end) for ends in module.contract.target_ranges.values() for end in ends)
    return FlatView(module.parts.high_level.view.places, farthest)


def flat_policy(state: RunState, module: Inference) -> FlatPolicy:
    """The averaged actor."""
    return FlatPolicy(state.sac.averaged_actor, view(module))


@eqx.filter_jit
def _explore(actor: Actor, observation, key: PRNGKeyArray) -> Float[AnyArray, "robot action"]:
    return actor.sample(observation, key)[0]
