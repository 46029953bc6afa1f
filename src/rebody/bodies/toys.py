"""The point masses ("toys" in the thesis): arithmetic on arrays of any batch shape, nothing to simulate.

One step is one decision. Disturbances make what the encoder sees resemble a robot (ripple, lag, gain)
or follow the thesis' noise (6.4-6.5); both are off in a nominal toy.
"""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float, PRNGKeyArray

from rebody.errors import unknown
from rebody.ranges import NotNegative, Positive
from rebody.types import DECISION_DT, AnyArray, GlobalState, global_state


class Disturbance(eqx.Module):
    """How one episode's toy departs from the nominal one."""

    ripple_amplitude: Float[AnyArray, "*batch"]  # m/s, of a sine on the velocity, as a gait has
    ripple_period: Float[AnyArray, "*batch"]  # s
    ripple_phase: Float[AnyArray, "*batch"]  # rad
    pitch_ripple: Float[AnyArray, "*batch"]  # rad/s, amplitude of the same sine on the pitch rate
    lag: Float[AnyArray, "*batch"]  # s, time constant between action and force
    gain: Float[AnyArray, "*batch"]  # share of the force that arrives
    state_noise: Float[AnyArray, "*batch"]  # std of the noise on x [m] and v [m/s] at each step


def no_disturbance(shape: tuple[int, ...]) -> Disturbance:
    """The nominal toy."""
    zero, one = jnp.zeros(shape), jnp.ones(shape)
    return Disturbance(zero, one, zero, zero, zero, one, zero)


@dataclass(frozen=True)
class Randomisation:
    """Ranges from which each episode's disturbance is drawn uniformly."""

    ripple_amplitude: NotNegative = 0.6
    """Largest amplitude of the ripple on the velocity [m/s]."""
    ripple_period: tuple[Positive, Positive] = (0.2, 0.8)
    """Shortest and longest period of the ripple [s]."""
    pitch_ripple: NotNegative = 1.0
    """Largest amplitude of the ripple on the pitch rate, where a toy has pitch [rad/s]."""
    lag: NotNegative = 0.5
    """Largest time constant of the force [s]."""
    gain: tuple[NotNegative, NotNegative] = (0.5, 1.0)
    """Smallest and largest share of the force that arrives."""
    state_noise: NotNegative = 0.0
    """Variance of the noise added to position and velocity at every step (thesis 6.4-6.5)."""

    def sample(self, key: PRNGKeyArray, shape: tuple[int, ...]) -> Disturbance:
        """One disturbance per episode."""
        keys = jax.random.split(key, 6)
        return Disturbance(
            ripple_amplitude=jax.random.uniform(keys[0], shape, maxval=self.ripple_amplitude),
            ripple_period=_between(keys[1], shape, self.ripple_period),
            ripple_phase=jax.random.uniform(keys[2], shape, maxval=2 * jnp.pi),
            pitch_ripple=jax.random.uniform(keys[5], shape, maxval=self.pitch_ripple),
            lag=jax.random.uniform(keys[3], shape, maxval=self.lag),
            gain=_between(keys[4], shape, self.gain),
            state_noise=jnp.full(shape, self.state_noise**0.5),
        )


def _between(key: PRNGKeyArray, shape: tuple[int, ...], bounds: tuple[float, float]) -> Float[AnyArray, "*batch"]:
    return jax.random.uniform(key, shape, minval=bounds[0], maxval=bounds[1])


class ToyState(eqx.Module):
    """Where a toy is; velocities are means over the last step, ripple included.

    Only the full toy has z and pitch; elsewhere they stay 0.
    """

    x: Float[AnyArray, "*batch"]  # m
    vx: Float[AnyArray, "*batch"]  # m/s, displacement over the last step divided by its duration
    z: Float[AnyArray, "*batch"]  # m, above the floor
    vz: Float[AnyArray, "*batch"]  # m/s
    pitch: Float[AnyArray, "*batch"]  # rad
    pitch_rate: Float[AnyArray, "*batch"]  # rad/s
    drift: Float[AnyArray, "*batch"]  # m/s, velocity along x without the ripple: what the dynamics act on
    turn: Float[AnyArray, "*batch"]  # rad/s, pitch rate without the ripple
    force: Float[AnyArray, "*batch"]  # N, behind the action where there is a lag
    torque: Float[AnyArray, "*batch"]  # N m, likewise
    time: Float[AnyArray, "*batch"]  # s
    disturbance: Disturbance


class Toy(eqx.Module):
    """A point mass that moves along x."""

    @property
    def actions(self) -> int:
        """Numbers in an action."""
        return 1

    @property
    def max_pitch(self) -> float:
        """Largest pitch that it can hold [rad]."""
        return 0.0

    @abstractmethod
    def step(self, state: ToyState, action: Float[AnyArray, "*batch action"], key: PRNGKeyArray) -> ToyState:
        """One decision with an action in [-1, 1]; the key feeds the noise."""

    def initial(
        self,
        x: Float[AnyArray, "*batch"],
        vx: Float[AnyArray, "*batch"],
        disturbance: Disturbance | None = None,
        pitch: Float[AnyArray, "*batch"] | float = 0.0,
    ) -> ToyState:
        """A toy at x [m] moving at vx [m/s], at a pitch [rad]; nominal unless a disturbance is given."""
        x, vx = jnp.asarray(x, jnp.float32), jnp.asarray(vx, jnp.float32)
        still = jnp.zeros_like(x)
        return ToyState(
            x=x,
            vx=vx,
            z=still,
            vz=still,
            pitch=jnp.broadcast_to(jnp.asarray(pitch, jnp.float32), x.shape),
            pitch_rate=still,
            drift=vx,
            turn=still,
            force=still,
            torque=still,
            time=still,
            disturbance=disturbance or no_disturbance(x.shape),
        )

    def observe(self, state: ToyState) -> GlobalState:
        """The global state; y never moves."""
        return global_state(
            x=state.x, z=state.z, pitch=state.pitch, vx=state.vx, vz=state.vz, pitch_rate=state.pitch_rate
        )

    def from_global(self, state: GlobalState) -> ToyState:
        """The nominal toy in the place of any body: where imagination starts (thesis 5.6.2)."""
        return self.initial(state.x, state.vx)

    def imagine(
        self, state: GlobalState, act: Callable[[GlobalState], Float[AnyArray, "*batch action"]], decisions: int
    ) -> GlobalState:
        """Where the nominal toy would be after each of so many decisions from there, [decision, *batch]."""
        key = jax.random.key(0)  # a nominal toy has no noise

        def step(body, _):
            body = self.step(body, act(self.observe(body)), key)
            return body, self.observe(body)

        return jax.lax.scan(step, self.from_global(state), None, length=decisions)[1]


class MassDamper(Toy):
    """m x'' = F - c x' (thesis 5.13, 6.5-6.6), semi-implicit Euler.

    The velocity is updated before the position, so that it equals displacement over time; the printed
    6.4 moves with the old velocity. Terminal speed max_force / damping: 3.5 m/s.
    """

    mass: Positive = 1.0  # kg
    damping: NotNegative = 2.0  # N s/m
    max_force: NotNegative = 7.0  # N

    def step(self, state: ToyState, action: Float[AnyArray, "*batch action"], key: PRNGKeyArray) -> ToyState:
        """The action is the share of the largest force."""
        disturbance = state.disturbance
        noise = disturbance.state_noise * jax.random.normal(key, (2, *state.x.shape))
        wanted = disturbance.gain * self.max_force * jnp.clip(action[..., 0], -1.0, 1.0)
        force = _follow(state.force, wanted, disturbance.lag)
        acceleration = (force - self.damping * state.drift) / self.mass
        drift = state.drift + DECISION_DT * acceleration + noise[0]
        return _move(state, drift, force, noise[1])


class PositionToy(Toy):
    """x' = x + a with |a| <= max_step (thesis 6.1)."""

    max_step: NotNegative = 0.1  # m

    def step(self, state: ToyState, action: Float[AnyArray, "*batch action"], key: PRNGKeyArray) -> ToyState:
        """The action is the share of the largest step."""
        noise = state.disturbance.state_noise * jax.random.normal(key, state.x.shape)
        wanted = state.disturbance.gain * self.max_step * jnp.clip(action[..., 0], -1.0, 1.0)
        return _move(state, wanted / DECISION_DT, state.force, noise)


class FullToy(MassDamper):
    """A mass-damper that can also jump off a floor and pitch (thesis B.1: three degrees of freedom).

    A spring rights it: it stands at up to max_torque / stiffness = 2.25 rad, and pitch never wraps.
    """

    gravity: NotNegative = 9.81  # m/s^2
    max_lift: NotNegative = 45.0  # N, while on the floor
    inertia: Positive = 1.0  # kg m^2
    stiffness: Positive = 4.0  # N m/rad
    turn_damping: NotNegative = 4.0  # N m s/rad
    max_torque: NotNegative = 9.0  # N m

    @property
    def actions(self) -> int:
        """Shares of the largest force, lift and torque."""
        return 3

    @property
    def max_pitch(self) -> float:
        """Where the largest torque balances the spring [rad]."""
        return self.max_torque / self.stiffness

    def step(self, state: ToyState, action: Float[AnyArray, "*batch action"], key: PRNGKeyArray) -> ToyState:
        """The floor lifts, never pulls, and only what stands on it."""
        moved = super().step(state, action, key)
        z, vz = self._lifted(state, action[..., 1])
        turn, torque = self._turned(state, action[..., 2])
        rate = turn + state.disturbance.pitch_ripple * _ripple(moved)
        pitch = state.pitch + DECISION_DT * rate
        return replace(moved, z=z, vz=vz, pitch=pitch, pitch_rate=rate, turn=turn, torque=torque)

    def _lifted(self, state: ToyState, share: Float[AnyArray, "*batch"]):
        lift = jnp.where(state.z <= 0, self.max_lift * jnp.clip(share, 0.0, 1.0), 0.0)
        vz = jnp.where(state.z <= 0, jnp.maximum(state.vz, 0.0), state.vz)  # a fall ends on the floor
        vz = vz + DECISION_DT * (lift / self.mass - self.gravity)
        z = jnp.maximum(state.z + DECISION_DT * vz, 0.0)
        return z, (z - state.z) / DECISION_DT

    def _turned(self, state: ToyState, share: Float[AnyArray, "*batch"]):
        wanted = state.disturbance.gain * self.max_torque * jnp.clip(share, -1.0, 1.0)
        torque = _follow(state.torque, wanted, state.disturbance.lag)
        righting = self.turn_damping * state.turn + self.stiffness * state.pitch
        return state.turn + DECISION_DT * (torque - righting) / self.inertia, torque

    def from_global(self, state: GlobalState) -> ToyState:
        """The nominal toy at the same height and pitch."""
        toy = self.initial(state.x, state.vx, pitch=state.pitch)
        return replace(toy, z=state.z, vz=state.vz, pitch_rate=state.pitch_rate, turn=state.pitch_rate)


def _follow(
    value: Float[AnyArray, "*batch"], wanted: Float[AnyArray, "*batch"], lag: Float[AnyArray, "*batch"]
) -> Float[AnyArray, "*batch"]:
    """One decision of a first-order lag [s]."""
    return value + (wanted - value) * DECISION_DT / (DECISION_DT + lag)


def _move(state: ToyState, drift, force, position_noise) -> ToyState:
    """Advance by one decision at a given velocity, the ripple added in position and velocity alike."""
    moved = replace(state, drift=drift, force=force, time=state.time + DECISION_DT)
    vx = drift + state.disturbance.ripple_amplitude * _ripple(moved)
    return replace(moved, x=state.x + DECISION_DT * vx + position_noise, vx=vx)


def _ripple(state: ToyState) -> Float[AnyArray, "*batch"]:
    """The sine of a gait, now."""
    disturbance = state.disturbance
    return jnp.sin(2 * jnp.pi * state.time / disturbance.ripple_period + disturbance.ripple_phase)


TOYS: dict[str, type[Toy]] = {"mass-damper": MassDamper, "position": PositionToy, "full": FullToy}


def make_toy(kind: str, **settings: float) -> Toy:
    """A toy by its name in `TOYS`; RebodyError if there is none."""
    if kind not in TOYS:
        raise unknown("toy", kind, TOYS)
    return TOYS[kind](**settings)


def describe_toy(toy: Toy) -> dict[str, Any]:
    """What `make_toy` needs to make it again."""
    kind = next(name for name, make in TOYS.items() if make is type(toy))
    return {"kind": kind, **asdict(toy)}
