"""The toys' MuJoCo models say the same as their arithmetic."""

import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from rebody.bodies.toy_models import mass_damper_model, position_toy_model
from rebody.bodies.toys import MassDamper, PositionToy

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
