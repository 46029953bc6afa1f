"""The point masses ("toys" in the thesis): arithmetic on arrays of any batch shape, nothing to simulate.

One step is one decision. Disturbances make what the encoder sees resemble a robot (ripple, lag, gain)
or follow the thesis' noise (6.4-6.5); both are off in a nominal toy.
"""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float, PRNGKeyArray

from rebody.errors import RebodyError
from rebody.types import DECISION_DT, AnyArray, GlobalState


class Disturbance(eqx.Module):
    """How one episode's toy departs from the nominal one."""

    ripple_amplitude: Float[AnyArray, "*batch"]  # m/s, of a sine on the velocity, as a gait has
    ripple_period: Float[AnyArray, "*batch"]  # s
    ripple_phase: Float[AnyArray, "*batch"]  # rad
    lag: Float[AnyArray, "*batch"]  # s, time constant between action and force
    gain: Float[AnyArray, "*batch"]  # share of the force that arrives
    state_noise: Float[AnyArray, "*batch"]  # std of the noise on x [m] and v [m/s] at each step


def no_disturbance(shape: tuple[int, ...]) -> Disturbance:
    """The nominal toy."""
    zero, one = jnp.zeros(shape), jnp.ones(shape)
    return Disturbance(zero, one, zero, zero, one, zero)


@dataclass(frozen=True)
class Randomisation:
    """Ranges from which each episode's disturbance is drawn uniformly."""

    ripple_amplitude: float = 0.6
    """Largest amplitude of the ripple on the velocity [m/s]."""
    ripple_period: tuple[float, float] = (0.2, 0.8)
    """Shortest and longest period of the ripple [s]."""
    lag: float = 0.5
    """Largest time constant of the force [s]."""
    gain: tuple[float, float] = (0.5, 1.0)
    """Smallest and largest share of the force that arrives."""
    state_noise: float = 0.0
    """Variance of the noise added to position and velocity at every step (thesis 6.4-6.5)."""

    def sample(self, key: PRNGKeyArray, shape: tuple[int, ...]) -> Disturbance:
        """One disturbance per episode."""
        keys = jax.random.split(key, 5)
        return Disturbance(
            ripple_amplitude=jax.random.uniform(keys[0], shape, maxval=self.ripple_amplitude),
            ripple_period=_between(keys[1], shape, self.ripple_period),
            ripple_phase=jax.random.uniform(keys[2], shape, maxval=2 * jnp.pi),
            lag=jax.random.uniform(keys[3], shape, maxval=self.lag),
            gain=_between(keys[4], shape, self.gain),
            state_noise=jnp.full(shape, self.state_noise**0.5),
        )


def _between(key: PRNGKeyArray, shape: tuple[int, ...], bounds: tuple[float, float]) -> Float[AnyArray, "*batch"]:
    return jax.random.uniform(key, shape, minval=bounds[0], maxval=bounds[1])


class ToyState(eqx.Module):
    """Where a toy is; `vx` holds the mean velocity of the last step, ripple included."""

    x: Float[AnyArray, "*batch"]  # m
    vx: Float[AnyArray, "*batch"]  # m/s, displacement over the last step divided by its duration
    drift: Float[AnyArray, "*batch"]  # m/s, velocity without the ripple: what the dynamics act on
    force: Float[AnyArray, "*batch"]  # N, behind the action where there is a lag
    time: Float[AnyArray, "*batch"]  # s
    disturbance: Disturbance


class Toy(eqx.Module):
    """A point mass that moves along x."""

    @abstractmethod
    def step(self, state: ToyState, action: Float[AnyArray, "*batch 1"], key: PRNGKeyArray) -> ToyState:
        """One decision with an action in [-1, 1]; the key feeds the noise."""

    def initial(
        self,
        x: Float[AnyArray, "*batch"],
        vx: Float[AnyArray, "*batch"],
        disturbance: Disturbance | None = None,
    ) -> ToyState:
        """A toy at x [m] moving at vx [m/s]; nominal unless a disturbance is given."""
        x, vx = jnp.asarray(x, jnp.float32), jnp.asarray(vx, jnp.float32)
        still = jnp.zeros_like(x)
        return ToyState(x, vx, vx, still, still, disturbance or no_disturbance(x.shape))

    def observe(self, state: ToyState) -> GlobalState:
        """The global state; y, z and pitch never move."""
        still = jnp.zeros_like(state.x)
        return GlobalState(state.x, still, still, still, state.vx, still, still, still)

    def from_global(self, state: GlobalState) -> ToyState:
        """The nominal toy in the place of any body: where imagination starts (thesis 5.6.2)."""
        return self.initial(state.x, state.vx)


class MassDamper(Toy):
    """m x'' = F - c x' (thesis 5.13, 6.5-6.6), semi-implicit Euler.

    The velocity is updated before the position, so that it equals displacement over time; the printed
    6.4 moves with the old velocity. Terminal speed max_force / damping: 3.5 m/s.
    """

    mass: float = 1.0  # kg
    damping: float = 2.0  # N s/m
    max_force: float = 7.0  # N

    def step(self, state: ToyState, action: Float[AnyArray, "*batch 1"], key: PRNGKeyArray) -> ToyState:
        """The action is the share of the largest force."""
        disturbance = state.disturbance
        noise = disturbance.state_noise * jax.random.normal(key, (2, *state.x.shape))
        wanted = disturbance.gain * self.max_force * jnp.clip(action[..., 0], -1.0, 1.0)
        force = state.force + (wanted - state.force) * DECISION_DT / (DECISION_DT + disturbance.lag)
        acceleration = (force - self.damping * state.drift) / self.mass
        drift = state.drift + DECISION_DT * acceleration + noise[0]
        time = state.time + DECISION_DT
        return _move(state, drift, force, time, noise[1])


class PositionToy(Toy):
    """x' = x + a with |a| <= max_step (thesis 6.1)."""

    max_step: float = 0.1  # m

    def step(self, state: ToyState, action: Float[AnyArray, "*batch 1"], key: PRNGKeyArray) -> ToyState:
        """The action is the share of the largest step."""
        noise = state.disturbance.state_noise * jax.random.normal(key, state.x.shape)
        wanted = state.disturbance.gain * self.max_step * jnp.clip(action[..., 0], -1.0, 1.0)
        return _move(state, wanted / DECISION_DT, state.force, state.time + DECISION_DT, noise)


def _move(state: ToyState, drift, force, time, position_noise) -> ToyState:
    """Advance by one decision at a given velocity, the ripple added in position and velocity alike."""
    disturbance = state.disturbance
    phase = 2 * jnp.pi * time / disturbance.ripple_period + disturbance.ripple_phase
    vx = drift + disturbance.ripple_amplitude * jnp.sin(phase)
    x = state.x + DECISION_DT * vx + position_noise
    return ToyState(x, vx, drift, force, time, disturbance)


TOYS: dict[str, Callable[..., Toy]] = {"mass-damper": MassDamper, "position": PositionToy}


def make_toy(kind: str, **settings: float) -> Toy:
    """A toy by its name in `TOYS`; RebodyError if there is none."""
    if kind not in TOYS:
        raise RebodyError(f"unknown toy '{kind}'. Toys are: {', '.join(TOYS)}.")
    return TOYS[kind](**settings)


def describe_toy(toy: Toy) -> dict[str, Any]:
    """What `make_toy` needs to make it again."""
    kind = next(name for name, make in TOYS.items() if make is type(toy))
    return {"kind": kind, **asdict(toy)}
