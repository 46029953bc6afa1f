"""The toys' MuJoCo models say the same as their arithmetic."""

import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from rebody.bodies.toy_models import mass_damper_model, position_toy_model, space_toy_model, toy_model
from rebody.bodies.toys import AXES, FullToy, MassDamper, PlaneToy, PositionToy, SpaceToy
from rebody.types import global_state

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
    state = toy.begin(global_state(x=jnp.asarray(0.3)))
    data.qpos[0] = 0.3
    for action in actions:
        state = step(state, jnp.asarray(action))
        data.ctrl[:] = action
        mujoco.mj_step(model, data)
        np.testing.assert_allclose([state.position[0], state.velocity[0]], [data.qpos[0], data.qvel[0]], atol=1e-5)


@pytest.mark.parametrize("toy", [FullToy(), FullToy(mass=2.0, gravity=5.0, max_lift=60.0, inertia=1.5, stiffness=3.0)])
def test_full_model_and_arithmetic_agree_in_flight_at_rest_and_in_pitch(toy):
    rng = np.random.default_rng(0)
    step = eqx.filter_jit(lambda state, action: toy.step(state, action, jax.random.key(0)))
    model = space_toy_model(toy)
    data = mujoco.MjData(model)
    state = toy.begin(global_state(x=jnp.asarray(0.0)))
    heights = []
    for i in range(200):
        jumps = float(i % 50 == 10)  # it has come to rest long before the next one
        action = np.array([rng.uniform(-1.2, 1.2), jumps, rng.uniform(-1.2, 1.2)], np.float32)
        state = step(state, jnp.asarray(action))
        data.ctrl[:] = action
        mujoco.mj_step(model, data)
        heights.append([float(state.position[2]), data.qpos[1]])
        np.testing.assert_allclose(state.position[jnp.array([0, 3])], data.qpos[[0, 2]], atol=1e-4)
        np.testing.assert_allclose(state.velocity[jnp.array([0, 3])], data.qvel[[0, 2]], atol=1e-4)
    z, model_z = np.array(heights).reshape(4, 50, 2)[:3].transpose(2, 0, 1)
    flies = z > 0
    np.testing.assert_allclose(model_z[flies], z[flies], atol=1e-3)
    np.testing.assert_allclose(model_z[:, :10], 0.0, atol=1e-3)
    assert z.max() > 0.5
    assert model_z.min() > -0.5


@pytest.mark.parametrize("toy", [PlaneToy(), PlaneToy(mass=2.0, inertia=0.5, max_torque=4.0), SpaceToy()])
def test_plane_and_space_agree_with_their_models(toy):
    """In space it stays on the floor, where a lift would leave the two apart by what a soft floor gives."""
    rng = np.random.default_rng(0)
    step = eqx.filter_jit(lambda state, action: toy.step(state, action, jax.random.key(0)))
    model = toy_model(toy)
    data = mujoco.MjData(model)
    order = [AXES.index(model.joint(i).name) for i in range(model.njnt)]
    state = toy.begin(global_state(x=jnp.asarray(0.0)))
    for _ in range(200):
        action = rng.uniform(-1.2, 1.2, toy.actions).astype(np.float32)
        if "z" in toy.axes:
            action[toy.axes.index("z")] = 0.0
        state = step(state, jnp.asarray(action))
        data.ctrl[:] = action
        mujoco.mj_step(model, data)
        np.testing.assert_allclose(np.asarray(state.position)[order], data.qpos, atol=2e-4)
        np.testing.assert_allclose(np.asarray(state.velocity)[order], data.qvel, atol=2e-4)


def test_a_toy_that_turns_first_has_no_model():
    with pytest.raises(TypeError, match="turns first has no model"):
        toy_model(PlaneToy(turns_first=True))
