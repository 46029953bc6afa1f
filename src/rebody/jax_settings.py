"""JAX as this package needs it, whatever the user's program has set for itself."""

from collections.abc import Iterator
from contextlib import contextmanager

import jax


@contextmanager
def own_jax_settings() -> Iterator[None]:
    """While inside, or in a function that it decorates, JAX has the settings that artifacts and seeds rely on.

    Weights are float32 and random numbers come from threefry keys; a user's program may compute in float64, draw from
    other generators, forbid promotions or stop at NaN (a subgoal that is not there is one) for its own code.
    """
    with (
        jax.enable_x64(False),
        jax.default_prng_impl("threefry2x32"),
        jax.threefry_partitionable(True),
        jax.numpy_dtype_promotion("standard"),
        jax.numpy_rank_promotion("allow"),
        jax.debug_nans(False),
        jax.debug_infs(False),
    ):
        yield
