"""The networks against what they are by definition."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.nn import GRU, MLP, MultiScale


def sigmoid(x):
    return 1 / (1 + np.exp(-x))


def gru_by_hand(cell, hidden, inputs):
    """Cho et al. 2014 gate by gate, in float64."""
    n = cell.units
    wr, wz, wn = (np.asarray(cell.from_input, np.float64)[:, i * n : (i + 1) * n] for i in range(3))
    ur, uz, un = (np.asarray(cell.from_hidden, np.float64)[:, i * n : (i + 1) * n] for i in range(3))
    br, bz, bn = (np.asarray(cell.bias, np.float64)[i * n : (i + 1) * n] for i in range(3))
    reset = sigmoid(inputs @ wr + hidden @ ur + br)
    update = sigmoid(inputs @ wz + hidden @ uz + bz)
    candidate = np.tanh(inputs @ wn + bn + reset * (hidden @ un + np.asarray(cell.candidate_bias)))
    return update * hidden + (1 - update) * candidate


def test_gru_step_against_the_equations():
    rng = np.random.default_rng(0)
    cell = GRU(3, 5, key=jax.random.key(0))
    biases = (jnp.asarray(rng.normal(size=15), jnp.float32), jnp.asarray(rng.normal(size=5), jnp.float32))
    cell = eqx.tree_at(lambda c: (c.bias, c.candidate_bias), cell, biases)
    hidden, inputs = rng.uniform(-1, 1, (2, 4, 5)), rng.normal(size=(2, 4, 3))
    stepped = cell(jnp.asarray(hidden, jnp.float32), jnp.asarray(inputs, jnp.float32))
    np.testing.assert_allclose(stepped, gru_by_hand(cell, hidden, inputs), atol=1e-6)


def test_gru_stays_in_its_bounds():
    cell = GRU(2, 8, key=jax.random.key(0))
    hidden = jnp.zeros(8)
    for _ in range(20):
        hidden = cell(hidden, jnp.asarray([50.0, -50.0]))
    assert jnp.abs(hidden).max() <= 1.0


@pytest.mark.parametrize("layer_norm", [False, True])
@pytest.mark.parametrize("batch", [(), (7,), (2, 7)])
def test_mlp_shapes(layer_norm, batch):
    net = MLP(3, 2, (8, 5), key=jax.random.key(0), layer_norm=layer_norm)
    assert [weight.shape for weight in net.weights] == [(3, 8), (8, 5), (5, 2)]
    assert net(jnp.ones((*batch, 3))).shape == (*batch, 2)


def test_mlp_without_hidden_layers_is_linear():
    net = MLP(3, 2, (), key=jax.random.key(0))
    x = jnp.asarray([1.0, -2.0, 0.5])
    np.testing.assert_allclose(net(x), x @ net.weights[0], rtol=1e-6)


def test_layer_norm_makes_hidden_layers_blind_to_scale():
    plain, normed = (MLP(3, 1, (16,), key=jax.random.key(0), layer_norm=norm) for norm in (False, True))
    x = jnp.asarray([1.0, -2.0, 0.5])
    np.testing.assert_allclose(normed(100 * x), normed(x), atol=1e-3)
    assert abs(plain(100 * x) - plain(x)) > 1.0


def test_last_scale_starts_a_policy_near_zero():
    full, tenth = (MLP(3, 1, (16,), key=jax.random.key(0), last_scale=scale) for scale in (1.0, 0.1))
    np.testing.assert_allclose(tenth(jnp.ones(3)), 0.1 * full(jnp.ones(3)), rtol=1e-5)


def test_multi_scale_sees_small_and_large_differences():
    layer = MultiScale(2, 1, key=jax.random.key(0))
    u = np.asarray(jnp.asarray([0.3, 0.1]) @ layer.projection)[0]
    seen = layer(jnp.asarray([0.3, 0.1]))
    np.testing.assert_allclose(seen, [0.3, 0.1, *np.tanh([3 * u, 12 * u, 50 * u])], rtol=1e-5)
    assert seen.shape == (layer.outputs,)
