"""How an episode's toy departs from the nominal one: the gait, lag and weakness of a robot, or noise (6.4-6.5)."""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float, PRNGKeyArray

from rebody.ranges import NotNegative, Positive
from rebody.types import AnyArray


class Disturbance(eqx.Module):
    """Of one episode. A gait is in the frame of the heading, and sways once in two steps."""

    ripple_amplitude: Float[AnyArray, "*batch"]  # m/s, of a sine on the velocity along the heading
    ripple_period: Float[AnyArray, "*batch"]  # s
    ripple_phase: Float[AnyArray, "*batch"]  # rad
    pitch_ripple: Float[AnyArray, "*batch"]  # rad/s, amplitude of the same sine on the pitch rate
    across_ripple: Float[AnyArray, "*batch"]  # m/s, amplitude of the sway across the heading
    yaw_ripple: Float[AnyArray, "*batch"]  # rad/s, amplitude of the sway of the heading
    lag: Float[AnyArray, "*batch"]  # s, time constant between action and force
    gain: Float[AnyArray, "*batch"]  # share of the force that arrives
    state_noise: Float[AnyArray, "*batch"]  # std of the noise on x, y [m] and vx, vy [m/s] at each step

    def ripple(self, time: Float[AnyArray, "*batch"]) -> Float[AnyArray, "*batch 5"]:
        """What a gait adds to the velocity along, across and upwards, and to the rates of pitch and yaw, at a time."""
        phase = 2 * jnp.pi * time / self.ripple_period + self.ripple_phase
        step, stride = jnp.sin(phase), jnp.sin(0.5 * phase)
        return jnp.stack(
            [
                self.ripple_amplitude * step,
                self.across_ripple * stride,
                jnp.zeros_like(step),
                self.pitch_ripple * step,
                self.yaw_ripple * stride,
            ],
            axis=-1,
        )


def no_disturbance(shape: tuple[int, ...]) -> Disturbance:
    """The nominal toy."""
    zero, one = jnp.zeros(shape), jnp.ones(shape)
    return Disturbance(zero, one, zero, zero, zero, zero, zero, one, zero)


@dataclass(frozen=True)
class Randomisation:
    """Ranges from which each episode's disturbance is drawn uniformly."""

    ripple_amplitude: NotNegative = 0.6
    """Largest amplitude of the ripple on the velocity along the heading [m/s]."""
    ripple_period: tuple[Positive, Positive] = (0.2, 0.8)
    """Shortest and longest period of the ripple [s]."""
    pitch_ripple: NotNegative = 1.0
    """Largest amplitude of the ripple on the pitch rate, where a toy has pitch [rad/s]."""
    across_ripple: NotNegative = 0.3
    """Largest amplitude of the sway across the heading, where a toy has y [m/s]."""
    yaw_ripple: NotNegative = 0.5
    """Largest amplitude of the sway of the heading, where a toy has one [rad/s]."""
    lag: NotNegative = 0.5
    """Largest time constant of the force [s]."""
    gain: tuple[NotNegative, NotNegative] = (0.5, 1.0)
    """Smallest and largest share of the force that arrives."""
    state_noise: NotNegative = 0.0
    """Variance of the noise added to place and velocity at every step (thesis 6.4-6.5)."""

    def sample(self, key: PRNGKeyArray, shape: tuple[int, ...]) -> Disturbance:
        """One disturbance per episode."""
        keys = jax.random.split(key, 8)
        return Disturbance(
            ripple_amplitude=jax.random.uniform(keys[0], shape, maxval=self.ripple_amplitude),
            ripple_period=_between(keys[1], shape, self.ripple_period),
            ripple_phase=jax.random.uniform(keys[2], shape, maxval=4 * jnp.pi),
            pitch_ripple=jax.random.uniform(keys[5], shape, maxval=self.pitch_ripple),
            across_ripple=jax.random.uniform(keys[6], shape, maxval=self.across_ripple),
            yaw_ripple=jax.random.uniform(keys[7], shape, maxval=self.yaw_ripple),
            lag=jax.random.uniform(keys[3], shape, maxval=self.lag),
            gain=_between(keys[4], shape, self.gain),
            state_noise=jnp.full(shape, self.state_noise**0.5),
        )


CALM = Randomisation(
    ripple_amplitude=0.0, pitch_ripple=0.0, across_ripple=0.0, yaw_ripple=0.0, lag=0.0, gain=(1.0, 1.0)
)
"""Nothing disturbs the toy."""


def _between(key: PRNGKeyArray, shape: tuple[int, ...], bounds: tuple[float, float]) -> Float[AnyArray, "*batch"]:
    return jax.random.uniform(key, shape, minval=bounds[0], maxval=bounds[1])
