"""The joystick toy: a body in the plane that follows a joystick as badly as robots do. Navigators learn on it."""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float, PRNGKeyArray

from rebody.bodies.walking.joystick import WAYS, Measured, fitting, joystick_command, navigator_sees
from rebody.ranges import NotNegative, Positive, Share
from rebody.types import DECISION_DT, AnyArray, GlobalState, global_state

Ways = Float[AnyArray, "*batch 3"]
"""Forward, sideways [m/s], turn [rad/s]."""


class Walker(eqx.Module):
    """How one robot follows: what is measured of it, and what is not."""

    measured: Measured
    gain: Ways  # share of a command that is reached
    lag: Ways  # s
    delay: Float[AnyArray, "*batch"]  # decisions, at most 1
    strays: Float[AnyArray, "*batch 2"]  # m/s ahead for each rad/s of turning either way, and sideways
    bias: Ways  # drift beside the one that is measured
    ripple: Ways  # amplitude of the gait's sines on the speeds
    period: Float[AnyArray, "*batch"]  # s, of a stride
    phase: Ways  # rad


class WalkerState(eqx.Module):
    """Where it is and how it moves, in the frame of its heading."""

    x: Float[AnyArray, "*batch"]
    y: Float[AnyArray, "*batch"]
    yaw: Float[AnyArray, "*batch"]
    speed: Ways  # without the gait's ripple
    moves: Ways  # with it
    time: Float[AnyArray, "*batch"]  # s
    command: Ways  # the last one


@dataclass(frozen=True)
class Walkers:
    """Ranges that robots are drawn from uniformly, forward, sideways and turn."""

    fastest: tuple[tuple[NotNegative, NotNegative], ...] = ((0.5, 1.6), (0.15, 0.9), (0.5, 1.6))
    """Of the largest command ahead, to the left, and of a turn [m/s, m/s, rad/s]."""
    backwards: tuple[NotNegative, NotNegative] = (0.3, 1.0)
    """Share of the fastest ahead."""
    dead: tuple[NotNegative, NotNegative, NotNegative] = (0.3, 0.3, 0.3)
    """Largest dead bands."""
    drift: tuple[NotNegative, NotNegative, NotNegative] = (0.2, 0.1, 0.15)
    """Largest drifts that are measured; a quarter of these is not."""
    gain: tuple[NotNegative, NotNegative] = (0.5, 1.2)
    """Share of a command that is reached."""
    lag: tuple[NotNegative, NotNegative] = (0.05, 0.8)
    """Time constants [s]."""
    delay: Share = 1.0
    """Largest delay, in decisions."""
    ripple: tuple[NotNegative, NotNegative, NotNegative] = (0.3, 0.3, 0.6)
    """Largest amplitudes of the gait's sines on the speeds."""
    period: tuple[Positive, Positive] = (0.3, 0.8)
    """Of a stride [s]."""
    straight: Share = 0.15
    """Share of the robots that cannot walk sideways."""
    strays: tuple[NotNegative, NotNegative] = (0.4, 0.4)
    """Largest speeds ahead and sideways for each rad/s of turning [m/s]."""
    narrow: Share = 0.3
    """Share of the robots that do not follow all ways at full at once."""

    def sample(self, key: PRNGKeyArray, size: int) -> Walker:
        """So many robots, half of them without dead bands, half without drift, half without ripple."""
        keys = iter(jax.random.split(key, 20))

        def between(low, high):
            return jax.random.uniform(next(keys), (size, 3), minval=jnp.asarray(low), maxval=jnp.asarray(high))

        high = between(*zip(*self.fastest, strict=True))
        sideways = jnp.where(jax.random.bernoulli(next(keys), self.straight, (size, 1)), 0.0, 1.0)
        high = high * jnp.concatenate([jnp.ones((size, 1)), sideways, jnp.ones((size, 1))], axis=-1)
        low = -high * jnp.where(jnp.arange(3) == 0, between(*self.backwards), 1.0)
        is_rough = jax.random.bernoulli(next(keys), 0.5, (4, size, 1))
        is_narrow = jax.random.bernoulli(next(keys), self.narrow, (size, 1))
        dead, drift = jnp.asarray(self.dead), jnp.asarray(self.drift)
        return Walker(
            measured=Measured(
                low,
                high,
                dead=jnp.minimum(is_rough[0] * between(0 * dead, dead), 0.6 * jnp.minimum(high, -low)),
                drift=is_rough[1] * between(-drift, drift),
                at_once=jnp.where(is_narrow, between(1.0, 2.0)[:, :1], float(len(WAYS))),
            ),
            gain=between(*self.gain),
            lag=between(*self.lag),
            delay=between(0.0, self.delay)[:, 0],
            strays=is_rough[3] * between((-0.5, -1.0, 0.0), 1.0)[:, :2] * jnp.asarray(self.strays),
            bias=0.25 * between(-drift, drift),
            ripple=is_rough[2] * between(0.0, self.ripple),
            period=between(*self.period)[:, 0],
            phase=between(0.0, 2 * jnp.pi),
        )


def begin(x: AnyArray, y: AnyArray, yaw: AnyArray, moves: Ways | float = 0.0) -> WalkerState:
    """At rest, or in motion, with the stick let go."""
    still = jnp.zeros((*jnp.shape(x), 3))
    return WalkerState(x, y, yaw, still + moves, still + moves, jnp.zeros(jnp.shape(x)), still)


def step(state: WalkerState, walker: Walker, action: Ways) -> WalkerState:
    """One decision of 0.1 s with an action in [-1, 1].

    Derivatives are those of a joystick without rest and dead band, which have none.
    """
    robot = walker.measured
    smooth = action * fitting(jnp.abs(action), robot, jnp) * jnp.where(action > 0, robot.high, -robot.low)
    command = smooth + jax.lax.stop_gradient(joystick_command(action, robot, jnp) - smooth)
    delay = walker.delay[..., None]
    felt = (1 - delay) * command + delay * state.command
    wanted = walker.gain * felt + robot.drift + walker.bias
    turning = felt[..., 2]
    wanted = wanted.at[..., 0].add(walker.strays[..., 0] * jnp.abs(turning))
    wanted = wanted.at[..., 1].add(walker.strays[..., 1] * turning)
    speed = state.speed + (wanted - state.speed) * DECISION_DT / (DECISION_DT + walker.lag)
    time = state.time + DECISION_DT
    wave = jnp.sin(2 * jnp.pi * (time / walker.period)[..., None] + walker.phase)
    moves = speed + walker.ripple * wave * jnp.any(command != 0, axis=-1, keepdims=True)  # who stands has no gait
    yaw = state.yaw + DECISION_DT * moves[..., 2]
    along = 0.5 * (state.yaw + yaw)
    cos, sin = jnp.cos(along), jnp.sin(along)
    x = state.x + DECISION_DT * (cos * moves[..., 0] - sin * moves[..., 1])
    y = state.y + DECISION_DT * (sin * moves[..., 0] + cos * moves[..., 1])
    return WalkerState(x, y, yaw, speed, moves, time, command)


def observe(state: WalkerState) -> GlobalState:
    """The global state."""
    cos, sin = jnp.cos(state.yaw), jnp.sin(state.yaw)
    ahead, left, turn = jnp.moveaxis(state.moves, -1, 0)
    yaw = jnp.arctan2(sin, cos)
    return global_state(
        x=state.x, y=state.y, yaw=yaw, vx=cos * ahead - sin * left, vy=sin * ahead + cos * left, yaw_rate=turn
    )


def sees(state: WalkerState, walker: Walker) -> Float[AnyArray, "*batch 16"]:
    """What a navigator knows of it."""
    return navigator_sees(observe(state), walker.measured, jnp)
