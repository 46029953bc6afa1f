"""JAX as this package needs it, whatever the user's program has set for itself."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

import jax

from rebody.errors import RebodyError

_cut_off = False
"""Whether this process was forked off one in which JAX ran: JAX's threads stayed behind there."""


def _note_fork() -> None:
    # JAX has no public name for this; were it gone, Python would print that, and go on
    from jax._src.xla_bridge import backends_are_initialized

    global _cut_off
    _cut_off = _cut_off or backends_are_initialized()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_note_fork)


@contextmanager
def own_jax_settings() -> Iterator[None]:
    """While inside, or in a function that it decorates, JAX has the settings that artifacts and seeds rely on.

    Weights are float32 and random numbers come from threefry keys; a user's program may compute in float64, draw from
    other generators, forbid promotions or stop at NaN (a subgoal that is not there is one) for its own code.

    RebodyError in a process that was forked after JAX was used: to compile a function there waits for ever.
    """
    if _cut_off:
        raise RebodyError(
            "this process was forked after JAX was used, so JAX can hang in it. Start it by 'spawn' or 'forkserver' "
            'instead, as in make_vec(..., vectorization_mode="async", vector_kwargs={"context": "spawn"}).'
        )
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
