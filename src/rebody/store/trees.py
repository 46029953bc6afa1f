"""Pytrees as flat, named NumPy arrays and back: the form in which everything is stored."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rebody.errors import RebodyError
from rebody.types import Tree

STORABLE_KINDS = "biuf"  # NumPy kinds: bool, int, unsigned, float; safetensors reads no others into NumPy
SHOWN_FAULTS = 4


def tree_to_arrays(tree: Any) -> dict[str, np.ndarray]:
    """Every array leaf under its dotted path, such as `encoder.cell.bias`; static leaves are skipped.

    Arrays are C-contiguous and may share memory with the tree. Typed random keys give their key data.

    Raises:
        ValueError: two leaves have the same name.
        TypeError: a dtype cannot be stored (bfloat16, complex, object).
    """
    arrays: dict[str, np.ndarray] = {}
    for name, leaf in _named_arrays(tree):
        if name in arrays:
            raise ValueError(f"two leaves are both called {name!r}")
        arrays[name] = _to_numpy(name, leaf)
    return arrays


def arrays_into_tree(template: Tree, arrays: Mapping[str, np.ndarray], what: str) -> Tree:
    """The template with its array leaves replaced by `arrays`: the inverse of `tree_to_arrays`.

    NumPy leaves come back as writable NumPy arrays, JAX leaves and leaves that are shapes alone
    (`equinox.filter_eval_shape`) as JAX arrays, static leaves as they are in the template. `what` names the arrays'
    origin in the message, such as "artifact goal-velocity".

    Raises:
        RebodyError: names, shapes or dtypes are not exactly those of the template.
    """
    faults = _faults({name: _described(leaf) for name, leaf in _named_arrays(template)}, arrays)
    if faults:
        more = f" and {len(faults) - SHOWN_FAULTS} more" if len(faults) > SHOWN_FAULTS else ""
        raise RebodyError(
            f"{what} does not fit what is built here: {'; '.join(faults[:SHOWN_FAULTS])}{more}. "
            "Use the settings it was made with, or make it anew."
        )
    names = iter([name for name, _ in _named_arrays(template)])
    return jax.tree_util.tree_map(lambda leaf: _like(leaf, arrays[next(names)]) if _is_stored(leaf) else leaf, template)


def tree_hash(tree: Any) -> str:
    """SHA-256 in hex over names, dtypes, shapes and bytes of all array leaves, in order of name."""
    digest = hashlib.sha256()
    for name, array in sorted(tree_to_arrays(tree).items()):
        digest.update(json.dumps([name, str(array.dtype), array.shape]).encode())
        digest.update(array.reshape(-1).view(np.uint8).data)
    return digest.hexdigest()


def _named_arrays(tree: Any) -> list[tuple[str, Any]]:
    leaves = jax.tree_util.tree_flatten_with_path(tree)[0]
    return [(jax.tree_util.keystr(path, simple=True, separator="."), leaf) for path, leaf in leaves if _is_stored(leaf)]


def _is_stored(leaf: Any) -> bool:
    return eqx.is_array(leaf) or isinstance(leaf, np.ndarray | np.generic | jax.ShapeDtypeStruct)


def _is_random_key(leaf: Any) -> bool:
    return isinstance(leaf, jax.Array) and jnp.issubdtype(leaf.dtype, jax.dtypes.prng_key)


def _to_numpy(name: str, leaf: Any) -> np.ndarray:
    # not ascontiguousarray: that turns 0-d arrays into 1-d ones
    array = np.asarray(jax.random.key_data(leaf) if _is_random_key(leaf) else leaf, order="C")
    if array.dtype.kind not in STORABLE_KINDS:
        raise TypeError(f"{name!r} has dtype {array.dtype}, which cannot be stored")
    return array


def _like(leaf: Any, array: np.ndarray) -> Any:
    if _is_random_key(leaf):
        return jax.random.wrap_key_data(jnp.array(array), impl=jax.random.key_impl(leaf))
    if isinstance(leaf, jax.Array | jax.ShapeDtypeStruct):
        return jnp.array(array)  # a copy, so that later writes to `array` cannot reach it
    if isinstance(leaf, np.generic):
        return array[()]
    return np.array(array)


def _faults(expected: Mapping[str, str], found: Mapping[str, np.ndarray]) -> list[str]:
    missing = [f"{name} is missing" for name in expected if name not in found]
    unexpected = [f"{name} is unexpected" for name in found if name not in expected]
    different = [
        f"{name} is {_described(found[name])} instead of {wanted}"
        for name, wanted in expected.items()
        if name in found and _described(found[name]) != wanted
    ]
    return missing + unexpected + different


def _described(leaf: Any) -> str:
    array = jax.random.key_data(leaf) if _is_random_key(leaf) else leaf
    return f"{array.dtype}{list(array.shape)}"
