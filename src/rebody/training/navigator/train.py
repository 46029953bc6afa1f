"""Training the navigator by gradients through the joystick toy: (subgoal from where the robot is, how it moves, what is
measured of it) -> joystick.

It is a tracker whose joints are a joystick's: one serves every robot that walks already, none of which it has seen.
"""

from dataclasses import asdict, replace
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Float, Int, PRNGKeyArray

from rebody.agents.configs import TrackerSettings
from rebody.agents.fits import ANY_WALKER
from rebody.bodies.walking import toy
from rebody.bodies.walking.joystick import NAVIGATED_M, NAVIGATOR_SEES, WAYS
from rebody.control.command import relative, within_sight
from rebody.control.sac import Actor, SACConfig
from rebody.control.tracker import Tracker, command_inputs
from rebody.jax_settings import own_jax_settings
from rebody.ranges import Box, check_ranges
from rebody.tasks import FamilySet
from rebody.tasks.plane import HEADING, PLACE, VELOCITY_XY
from rebody.training.card import save
from rebody.training.descent import descend
from rebody.training.navigator.config import NavigatorConfig
from rebody.training.navigator.to_go import error_to_go, time_to_go
from rebody.training.run import Metrics, Run
from rebody.types import DECISION_DT, POSE_FIELDS, AnyArray, Subgoal

NAVIGATED = FamilySet(
    (
        PLACE.within(Box((-NAVIGATED_M,) * 2, (NAVIGATED_M,) * 2)),
        VELOCITY_XY.within(Box((-2.0, -2.0), (2.0, 2.0))),
        HEADING,
    )
)
"""What a navigator can be told."""
PLACES, VELOCITIES, HEADINGS = range(3)
HELD_OUT_DECISIONS = 200
"""Length of the courses of a measurement: time to reach a place that is far."""


class RunState(eqx.Module):
    """Everything that a resumed run needs."""

    actor: Actor
    optimiser: optax.OptState
    iteration: Int[Array, ""]


class Course(eqx.Module):
    """What happened at a decision, or along a course [decision, course]."""

    left: Float[AnyArray, "*batch"]  # distance from what was asked [m, m/s, rad]
    speed: Float[AnyArray, "*batch"]  # m/s
    change: Float[AnyArray, "*batch"]  # mean squared change of the stick
    effort: Float[AnyArray, "*batch"]  # mean square of the stick


@own_jax_settings()
def train_navigator(
    config: NavigatorConfig, out: Path, seed: int, *, resume: bool = False, finish: bool = False
) -> Path:
    """Train a navigator; returns the artifact's folder.

    RebodyError if `out` holds another run; Interrupted on Ctrl-C.
    """
    check_ranges(config)
    with Run(out, asdict(config) | {"seed": seed}, resume=resume, finish=finish) as run:
        key = jax.random.key(seed)
        state = run.restore(initial_state(config, key))
        state = run.loop(state, lambda state: iterate(state, config, key), config.iterations, "navigator")
        return save_navigator(state.actor, config, run)


def initial_state(config: NavigatorConfig, key: PRNGKeyArray) -> RunState:
    """A fresh network."""
    sizes = SACConfig(hidden=config.hidden, projections=config.projections)
    actor = Actor(NAVIGATOR_SEES + command_inputs(NAVIGATED), len(WAYS), sizes, key)
    return RunState(actor, _optimiser(config).init(eqx.filter(actor, eqx.is_array)), jnp.zeros((), jnp.int32))


def iterate(state: RunState, config: NavigatorConfig, key: PRNGKeyArray) -> tuple[RunState, Metrics]:
    """Some updates."""
    actor, optimiser, metrics = learn(state, config, jax.random.fold_in(key, int(state.iteration)))
    return RunState(actor, optimiser, state.iteration + 1), {name: float(value) for name, value in metrics.items()}


@eqx.filter_jit
def learn(state: RunState, config: NavigatorConfig, key: PRNGKeyArray):
    """Steps down what courses cost, with robots and subgoals drawn anew each time."""

    def loss(actor: Actor, key: PRNGKeyArray):
        told, course, to_go = drive(actor, config, config.courses, key)
        price = course.left + config.change_price * course.change + config.effort_price * course.effort
        price = price + config.speed_price * jnp.where(told.slot == HEADINGS, course.speed, 0.0)
        return jnp.mean(price) + config.to_go_price * jnp.mean(to_go), {"left": jnp.mean(course.left)}

    keys = jax.random.split(key, config.updates)
    return descend(state.actor, state.optimiser, _optimiser(config), loss, keys)


def drive(
    actor: Actor, config: NavigatorConfig, size: int, key: PRNGKeyArray
) -> tuple[Subgoal, Course, Float[AnyArray, " course"]]:
    """Robots, half of them at rest, that are told one thing each, what they make of it, and what it will still cost
    them [s, m]."""
    walker_key, told_key, ahead_key, moves_key = jax.random.split(key, 4)
    walker, told = config.walkers.sample(walker_key, size), subgoals(config, size, told_key)
    ahead = NAVIGATED_M * jax.random.uniform(ahead_key, (size,), minval=0.5)
    tracker, still = Tracker(actor, NAVIGATED), jnp.zeros(size)

    def command(state):
        return relative(NAVIGATED, told, _pose(toy.observe(state)))

    def step(walk, _):
        state, held = walk
        action = tracker(toy.sees(state, walker), within_sight(NAVIGATED, command(state), ahead))
        state = toy.step(state, walker, action)
        seen = toy.observe(state)
        left = [_far(family, seen, told) for family in NAVIGATED]
        left = jnp.select([told.slot == i for i in range(len(left))], left)
        speed = jnp.sqrt(seen.vx**2 + seen.vy**2 + 1e-12)
        change, effort = (jnp.mean(of**2, axis=-1) for of in (action - held, action))
        return (state, action), Course(left, speed, change, effort)

    share = jax.random.uniform(moves_key, (size, len(WAYS)), minval=-1.0) * (jnp.arange(size) % 2)[:, None]
    moves = jnp.abs(share) * jnp.where(share > 0, walker.measured.high, walker.measured.low)
    begun = toy.begin(still, still, still, moves), jnp.zeros((size, len(WAYS)))
    (ended, _), course = jax.lax.scan(step, begun, None, length=config.decisions)
    asked = jnp.where((told.slot == HEADINGS)[:, None], 1.0, command(ended).value)  # the bearing of 0 has no slope
    to_go = [time_to_go(walker, asked), error_to_go(walker, asked), jnp.zeros(size)]
    return told, course, jnp.select([told.slot == i for i in (PLACES, VELOCITIES, HEADINGS)], to_go)


def subgoals(config: NavigatorConfig, size: int, key: PRNGKeyArray) -> Subgoal:
    """A third places, a third velocities, a third headings, as seen from robots at home."""
    slot_key, where_key, bearing_key, near_key = jax.random.split(key, 4)
    slot = jax.random.randint(slot_key, (size,), 0, len(NAVIGATED))
    is_near = jax.random.bernoulli(near_key, config.near, (size,))
    share = jax.random.uniform(where_key, (size,))
    bearing = jax.random.uniform(bearing_key, (size,), minval=-jnp.pi, maxval=jnp.pi)
    far = jnp.select([slot == PLACES], [jnp.where(is_near, 0.5, config.far)], 1.5)
    heading = jnp.where(is_near, 0.5 / jnp.pi, 1.0) * bearing
    first = jnp.where(slot == HEADINGS, heading, far * share * jnp.cos(bearing))
    second = jnp.where(slot == HEADINGS, 0.0, far * share * jnp.sin(bearing))
    return Subgoal(slot, jnp.stack([first, second], axis=-1))


def _far(family, seen, told: Subgoal) -> Float[AnyArray, " course"]:
    return family.quantity.distance(family.quantity.read(seen), told.value[..., : family.size])


def _pose(state) -> Float[AnyArray, "*batch 6"]:
    return state.select(POSE_FIELDS)


def save_navigator(actor: Actor, config: NavigatorConfig, run: Run) -> Path:
    """Measure on robots that it was not trained on, write artifact and card."""
    longer = replace(config, decisions=HELD_OUT_DECISIONS)
    told, course, _ = eqx.filter_jit(drive)(actor, longer, config.held_out, jax.random.key(2**31 - 1))
    ended = np.asarray(course.left[-10:]).mean(axis=0)
    rows = {}
    for i, family in enumerate(NAVIGATED):
        left = ended[np.asarray(told.slot) == i]
        says = f"{np.median(left):.3f} / {np.percentile(left, 95):.3f} {family.unit}"
        rows[f"{family.name}: left after {HELD_OUT_DECISIONS * DECISION_DT:g} s, median / p95"] = says
    settings = TrackerSettings(
        robot=ANY_WALKER,
        families=NAVIGATED,
        observations=actor.observations,
        actions=actor.actions,
        hidden=config.hidden,
        projections=config.projections,
        training=run.training(config),
    )
    what = (
        "Turns subgoals into joystick commands for any robot that walks by a policy of its own: it sees how the robot "
        "moves and what was measured of it. Learned on a joystick toy; no robot took part."
    )
    return save("tracker", settings, Tracker(actor, NAVIGATED), run, "Navigator", what, rows)


def _optimiser(config: NavigatorConfig) -> optax.GradientTransformation:
    schedule = optax.cosine_decay_schedule(config.learning_rate, max(1, config.updates * config.iterations), alpha=0.02)
    return optax.chain(optax.clip_by_global_norm(1.0), optax.adam(schedule))
