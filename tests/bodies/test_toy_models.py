"""The toys' MuJoCo models say the same as their arithmetic."""

import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from rebody.bodies.toy_models import full_toy_model, mass_damper_model, position_toy_model
from rebody.bodies.toys import FullToy, MassDamper, PositionToy

CASES = [
    (MassDamper(), mass_damper_model),
    (MassDamper(mass=2.5, damping=0.7, max_force=3.0), mass_damper_model),
    (PositionToy(), position_toy_model),
    (PositionToy(max_step=0.35), position_toy_model),
]


@pytest.mark.parametrize(("toy", "model_of"), CASES)
def test_model_and_arithmetic_agree_step_by_step(toy, model_of):
    actions = np.random.default_rng(0).uniform(-1.2, 1.2, (200, 1)).astype(np.float32)
    step = eqx.filter_jit(lambda state, action: toy.step(state, action, jax.random.key(0)))
    model = model_of(toy)
    data = mujoco.MjData(model)
    state = toy.initial(jnp.asarray(0.3), jnp.asarray(0.0))
    data.qpos[0] = 0.3
    for action in actions:
        state = step(state, jnp.asarray(action))
        data.ctrl[:] = action
        mujoco.mj_step(model, data)
        np.testing.assert_allclose([state.x, state.vx], [data.qpos[0], data.qvel[0]], atol=1e-5)


@pytest.mark.parametrize("toy", [FullToy(), FullToy(mass=2.0, gravity=5.0, max_lift=60.0, inertia=1.5, stiffness=3.0)])
def test_full_model_and_arithmetic_agree_in_flight_at_rest_and_in_pitch(toy):
    rng = np.random.default_rng(0)
    step = eqx.filter_jit(lambda state, action: toy.step(state, action, jax.random.key(0)))
    model = full_toy_model(toy)
    data = mujoco.MjData(model)
    state = toy.initial(jnp.asarray(0.0), jnp.asarray(0.0))
    heights = []
    for i in range(200):
        jumps = float(i % 50 == 10)  # it has come to rest long before the next one
        action = np.array([rng.uniform(-1.2, 1.2), jumps, rng.uniform(-1.2, 1.2)], np.float32)
        state = step(state, jnp.asarray(action))
        data.ctrl[:] = action
        mujoco.mj_step(model, data)
        heights.append([float(state.z), data.qpos[1]])
        np.testing.assert_allclose([state.x, state.pitch], data.qpos[[0, 2]], atol=1e-4)
        np.testing.assert_allclose([state.vx, state.pitch_rate], data.qvel[[0, 2]], atol=1e-4)
    z, model_z = np.array(heights).reshape(4, 50, 2)[:3].transpose(2, 0, 1)
    flies = z > 0
    np.testing.assert_allclose(model_z[flies], z[flies], atol=1e-3)
    np.testing.assert_allclose(model_z[:, :10], 0.0, atol=1e-3)
    assert z.max() > 0.5
    assert model_z.min() > -0.5
