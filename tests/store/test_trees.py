"""Trees survive the way to named arrays and back, and nothing else is let in."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from rebody.errors import RebodyError
from rebody.store import arrays_into_tree, tree_hash, tree_to_arrays

DTYPES = (np.bool_, np.int32, np.int64, np.uint32, np.float32, np.float64)
any_array = st.sampled_from(DTYPES).flatmap(
    lambda dtype: hnp.arrays(dtype, hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=3))
)


def mixed_tree():
    network = eqx.nn.MLP(2, 1, 3, 1, key=jax.random.key(0))
    return {
        "network": network,
        "optimiser": optax.adam(1e-3).init(eqx.filter(network, eqx.is_array)),
        "replay": (np.zeros((4, 0)), np.array(3), [np.float64(0.5), jnp.array(True)]),
        "keys": (jax.random.key(1), jax.random.PRNGKey(2)),
        "static": 7,
    }


def test_names_are_readable_and_static_leaves_are_skipped():
    names = tree_to_arrays(mixed_tree())
    assert {"network.layers.0.weight", "optimiser.0.mu.layers.1.bias", "replay.2.0", "keys.0"} <= set(names)
    assert "static" not in names


def test_every_leaf_comes_back_as_it_was():
    tree = mixed_tree()
    blank = jax.tree.map(lambda leaf: np.zeros_like(leaf) if isinstance(leaf, np.ndarray) else leaf, tree)
    restored = arrays_into_tree(blank, tree_to_arrays(tree), "test")
    assert eqx.tree_equal(restored, tree)
    assert [type(leaf) for leaf in jax.tree.leaves(restored)] == [type(leaf) for leaf in jax.tree.leaves(tree)]
    assert restored["static"] == 7
    assert jax.random.uniform(restored["keys"][0]) == jax.random.uniform(tree["keys"][0])


@settings(max_examples=40, deadline=None)
@given(st.dictionaries(st.text(max_size=3), any_array, max_size=3))
def test_any_shape_and_dtype_survives(tree):
    restored = arrays_into_tree(tree, tree_to_arrays(tree), "test")
    assert tree_hash(restored) == tree_hash(tree)
    for name, array in tree.items():
        np.testing.assert_array_equal(restored[name], array)
        assert (restored[name].dtype, restored[name].shape) == (array.dtype, array.shape)


def test_restored_arrays_are_writable_and_independent():
    template, arrays = (np.zeros(2), jnp.zeros(2)), {"0": np.ones(2), "1": np.ones(2, np.float32)}
    host, device = arrays_into_tree(template, arrays, "test")
    host[:], arrays["1"][:] = 5.0, 5.0
    assert (arrays["0"] == 1).all()
    assert (device == 1).all()


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({}, "a is missing"),
        ({"a": np.zeros(2), "b": np.zeros(2)}, "b is unexpected"),
        ({"a": np.zeros(3)}, r"a is float64\[3\] instead of float64\[2\]"),
        ({"a": np.zeros(2, np.float32)}, r"a is float32\[2\] instead of float64\[2\]"),
        ({str(i): np.zeros(1) for i in range(9)}, "and 6 more"),
    ],
)
def test_what_does_not_fit_is_named(arrays, message):
    with pytest.raises(RebodyError, match=message) as error:
        arrays_into_tree({"a": np.zeros(2)}, arrays, "artifact test")
    assert str(error.value).startswith("artifact test does not fit")


def test_equal_names_and_foreign_dtypes_are_refused():
    with pytest.raises(ValueError, match=r"both called 'a\.b'"):
        tree_to_arrays({"a.b": np.zeros(1), "a": {"b": np.zeros(1)}})
    with pytest.raises(TypeError, match="bfloat16"):
        tree_to_arrays(jnp.zeros(1, jnp.bfloat16))


@pytest.mark.parametrize(
    "other",
    [
        {"b": np.zeros(2)},
        {"a": np.zeros(2, np.int64)},
        {"a": np.zeros((2, 1))},
        {"a": np.array([0.0, 1e-300])},
    ],
)
def test_hash_sees_name_dtype_shape_and_bytes(other):
    tree = {"a": np.zeros(2)}
    assert tree_hash(tree) == tree_hash({"a": np.zeros(2)})
    assert tree_hash(tree) != tree_hash(other)
