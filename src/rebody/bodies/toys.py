"""The point masses ("toys" in the thesis): arithmetic on arrays of any batch shape, nothing to simulate.

One step is one decision. A toy of a class moves along some of `AXES`; one of `SpaceToy` along all that are not held.
"""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, PRNGKeyArray

from rebody.bodies.attitude import wrap_angle
from rebody.bodies.disturbance import Disturbance, no_disturbance
from rebody.errors import unknown
from rebody.ranges import NotNegative, Positive
from rebody.types import DECISION_DT, AnyArray, GlobalState, global_state

Axis = Literal["x", "y", "z", "pitch", "yaw"]
AXES: tuple[Axis, ...] = ("x", "y", "z", "pitch", "yaw")
"""That a toy may move along, in the order of its action's numbers."""
RATES = ("vx", "vy", "vz", "pitch_rate", "yaw_rate")
X, Y, Z, PITCH, YAW = range(5)

OfAxes = Float[AnyArray, "*batch 5"]
"""A number for each of `AXES`."""


class ToyState(eqx.Module):
    """Where a toy is, axis by axis; velocities are means over the last step, ripple included."""

    position: OfAxes  # m, rad; z above the floor
    velocity: OfAxes  # m/s, rad/s: displacement over the last step divided by its duration
    drift: OfAxes  # velocity without the ripple: what the dynamics act on
    force: OfAxes  # N, N m, behind the action where there is a lag
    time: Float[AnyArray, "*batch"]  # s
    disturbance: Disturbance


class Toy(eqx.Module):
    """A point mass."""

    @property
    def axes(self) -> tuple[Axis, ...]:
        """What it moves along, a line unless it says otherwise; along all others it stays at 0."""
        return ("x",)

    @property
    def actions(self) -> int:
        """Numbers in an action."""
        return len(self.axes)

    @property
    def max_pitch(self) -> float:
        """Largest pitch that it can hold [rad]."""
        return 0.0

    @property
    def moves(self) -> Bool[np.ndarray, " 5"]:
        """Whether it moves along each of `AXES`."""
        return np.array([axis in self.axes for axis in AXES])

    @abstractmethod
    def step(self, state: ToyState, action: Float[AnyArray, "*batch action"], key: PRNGKeyArray) -> ToyState:
        """One decision with an action in [-1, 1]; the key feeds the noise."""

    def observe(self, state: ToyState) -> GlobalState:
        """The global state; roll never moves."""
        fields = dict(zip(AXES, jnp.moveaxis(state.position, -1, 0), strict=True))
        fields["yaw"] = wrap_angle(fields["yaw"])
        return global_state(**fields, **dict(zip(RATES, jnp.moveaxis(state.velocity, -1, 0), strict=True)))

    def begin(self, state: GlobalState, disturbance: Disturbance | None = None) -> ToyState:
        """A toy in the place of any body, as far as it can be (thesis 5.6.2); nominal unless a disturbance is given."""
        position, velocity = (
            jnp.where(self.moves, jnp.asarray(state.select(names), jnp.float32), 0.0) for names in (AXES, RATES)
        )
        shape = position.shape[:-1]
        return ToyState(
            position=position,
            velocity=velocity,
            drift=velocity,
            force=jnp.zeros_like(position),
            time=jnp.zeros(shape),
            disturbance=no_disturbance(shape) if disturbance is None else disturbance,
        )

    def imagine(
        self, state: GlobalState, act: Callable[[GlobalState], Float[AnyArray, "*batch action"]], decisions: int
    ) -> GlobalState:
        """Where the nominal toy would be after each of so many decisions from there, [decision, *batch]."""
        key = jax.random.key(0)  # a nominal toy has no noise

        def step(body, _):
            body = self.step(body, act(self.observe(body)), key)
            return body, self.observe(body)

        return jax.lax.scan(step, self.begin(state), None, length=decisions)[1]

    def _wanted(self, action: Float[AnyArray, "*batch action"], largest: tuple[float, ...]) -> OfAxes:
        """The action's shares of the largest along each axis."""
        axes, still = self.axes, jnp.zeros_like(action[..., 0])
        shares = [action[..., axes.index(axis)] if axis in axes else still for axis in AXES]
        return jnp.asarray(largest) * jnp.clip(jnp.stack(shares, axis=-1), -1.0, 1.0)

    def _moved(self, state: ToyState, drift: OfAxes, force: OfAxes, noise: OfAxes) -> ToyState:
        """One decision on at a given velocity, the ripple added in position and velocity alike."""
        time = state.time + DECISION_DT
        ripple = self._from_heading(state, state.disturbance.ripple(time))
        velocity = drift + jnp.where(self.moves, ripple, 0.0)
        position = state.position + DECISION_DT * velocity + noise
        return replace(state, position=position, velocity=velocity, drift=drift, force=force, time=time)

    def _from_heading(self, state: ToyState, vector: OfAxes) -> OfAxes:
        """What is along and across the heading as it is along x and y."""
        return _turned(vector, state.position[..., YAW]) if "yaw" in self.axes else vector

    def _noise(self, state: ToyState, key: PRNGKeyArray) -> Float[AnyArray, "2 *batch 5"]:
        """On velocity and place, along x and y where it moves."""
        felt = self.moves & (np.arange(len(AXES)) <= Y)
        noise = jax.random.normal(key, (2, *state.position.shape))
        return jnp.where(felt, state.disturbance.state_noise[..., None] * noise, 0.0)


class PositionToy(Toy):
    """x' = x + a with |a| <= max_step (thesis 6.1)."""

    max_step: NotNegative = 0.1  # m

    def step(self, state: ToyState, action: Float[AnyArray, "*batch action"], key: PRNGKeyArray) -> ToyState:
        """The action is the share of the largest step."""
        wanted = state.disturbance.gain[..., None] * self._wanted(action, (self.max_step,) * len(AXES))
        return self._moved(state, wanted / DECISION_DT, state.force, self._noise(state, key)[1])


class MassDamper(Toy):
    """m x'' = F - c x' (thesis 5.13, 6.5-6.6), semi-implicit Euler.

    The velocity is updated before the position, so that it equals displacement over time; the printed
    6.4 moves with the old velocity. Terminal speed max_force / damping: 3.5 m/s.
    """

    mass: Positive = 1.0  # kg
    damping: NotNegative = 2.0  # N s/m
    max_force: NotNegative = 7.0  # N

    def step(self, state: ToyState, action: Float[AnyArray, "*batch action"], key: PRNGKeyArray) -> ToyState:
        """The action is the share of the largest force along each axis."""
        disturbance, noise = state.disturbance, self._noise(state, key)
        wanted = disturbance.gain[..., None] * self._forced(state, action)
        force = state.force + (wanted - state.force) * (DECISION_DT / (DECISION_DT + disturbance.lag))[..., None]
        drift = state.drift + DECISION_DT * self._acceleration(state, force) + noise[0]
        return self._moved(state, drift, force, noise[1])

    def _forced(self, state: ToyState, action: Float[AnyArray, "*batch action"]) -> OfAxes:
        return self._wanted(action, (self.max_force,) * len(AXES))

    def _acceleration(self, state: ToyState, force: OfAxes) -> OfAxes:
        return (force - self.damping * state.drift) / self.mass


class SpaceToy(MassDamper):
    """A mass-damper in space: it runs in the plane, jumps off a floor, pitches and turns (thesis B.1, and f_y of 6.6).

    A spring rights it: it pitches by up to max_torque / stiffness = 2.25 rad, and pitch never wraps. It turns by up to
    max_torque / turn_damping = 2.25 rad/s.
    """

    gravity: NotNegative = 9.81  # m/s^2
    max_lift: NotNegative = 45.0  # N, while on the floor
    inertia: Positive = 1.0  # kg m^2
    stiffness: Positive = 4.0  # N m/rad
    turn_damping: NotNegative = 4.0  # N m s/rad
    max_torque: NotNegative = 9.0  # N m
    held: tuple[Axis, ...] = eqx.field(static=True, default=())
    """Axes that it does not move along."""
    turns_first: bool = eqx.field(static=True, default=False)
    """Whether nothing but a force along its heading moves it."""

    @property
    def axes(self) -> tuple[Axis, ...]:
        """All that are not held."""
        return tuple(axis for axis in AXES if axis not in self.held)

    @property
    def max_pitch(self) -> float:
        """Where the largest torque balances the spring [rad]."""
        return 0.0 if "pitch" in self.held else self.max_torque / self.stiffness

    def step(self, state: ToyState, action: Float[AnyArray, "*batch action"], key: PRNGKeyArray) -> ToyState:
        """The floor lifts, never pulls, and only what stands on it; lag and gain are not of a lift."""
        moved = super().step(state, action, key)
        if "z" in self.held:
            return moved
        z, vz = self._lifted(state, action[..., self.axes.index("z")])
        upwards = (("position", z), ("velocity", vz), ("drift", vz))
        return replace(moved, **{name: _with_z(getattr(moved, name), value) for name, value in upwards})

    def _forced(self, state: ToyState, action: Float[AnyArray, "*batch action"]) -> OfAxes:
        wanted = self._wanted(action, (self.max_force, self.max_force, 0.0, self.max_torque, self.max_torque))
        if not self.turns_first:
            return wanted
        along = _turned(wanted, -state.position[..., YAW]) * (np.arange(len(AXES)) != Y)
        return jnp.where(self.moves, self._from_heading(state, along), 0.0)

    def _acceleration(self, state: ToyState, force: OfAxes) -> OfAxes:
        inertia = jnp.asarray([self.mass, self.mass, self.mass, self.inertia, self.inertia])
        damping = jnp.asarray([self.damping, self.damping, 0.0, self.turn_damping, self.turn_damping])
        righting = state.position * jnp.asarray([0.0, 0.0, 0.0, self.stiffness, 0.0])
        return (force - damping * state.drift - righting) / inertia

    def _lifted(self, state: ToyState, share: Float[AnyArray, "*batch"]):
        z, vz = state.position[..., Z], state.velocity[..., Z]
        lift = jnp.where(z <= 0, self.max_lift * jnp.clip(share, 0.0, 1.0), 0.0)
        vz = jnp.where(z <= 0, jnp.maximum(vz, 0.0), vz)  # a fall ends on the floor
        vz = vz + DECISION_DT * (lift / self.mass - self.gravity)
        lifted = jnp.maximum(z + DECISION_DT * vz, 0.0)
        return lifted, (lifted - z) / DECISION_DT


class FullToy(SpaceToy):
    """One that jumps and pitches on a line (thesis B.1: three degrees of freedom)."""

    held: tuple[Axis, ...] = eqx.field(static=True, default=("y", "yaw"))


class PlaneToy(SpaceToy):
    """One that runs and turns in the plane."""

    held: tuple[Axis, ...] = eqx.field(static=True, default=("z", "pitch"))


def _turned(vector: OfAxes, angle: Float[AnyArray, "*batch"]) -> OfAxes:
    """The same with x and y turned about the vertical."""
    cos, sin = jnp.cos(angle), jnp.sin(angle)
    x, y = vector[..., X], vector[..., Y]
    plane = jnp.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)
    return jnp.concatenate([plane, vector[..., Z:]], axis=-1)


def _with_z(vector: OfAxes, z: Float[AnyArray, "*batch"]) -> OfAxes:
    return jnp.where(np.arange(len(AXES)) == Z, z[..., None], vector)


TOYS: dict[str, type[Toy]] = {
    "mass-damper": MassDamper,
    "position": PositionToy,
    "full": FullToy,
    "plane": PlaneToy,
    "space": SpaceToy,
}


def make_toy(kind: str, **settings: Any) -> Toy:
    """A toy by its name in `TOYS`; RebodyError if there is none."""
    if kind not in TOYS:
        raise unknown("toy", kind, TOYS)
    return TOYS[kind](**settings)


def describe_toy(toy: Toy) -> dict[str, Any]:
    """What `make_toy` needs to make it again."""
    kind = next(name for name, make in TOYS.items() if make is type(toy))
    return {"kind": kind, **asdict(toy)}
