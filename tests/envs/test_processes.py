"""Environments in processes of their own: spawned ones work; one that was forked after JAX was used says so."""

import os
import subprocess
import sys

import gymnasium
import jax.numpy as jnp
import numpy as np
import pytest

CHEETAH, TRACKER = "rebody/HalfCheetah-v0", "rebody/HalfCheetahTracker-v0"
FORKED = """
import sys, gymnasium, rebody, jax, numpy as np
if sys.argv[2] == "used":
    jax.numpy.zeros(1)
envs = gymnasium.make_vec(sys.argv[1], 2, vectorization_mode="async", vector_kwargs={"context": "fork"})
envs.reset(seed=0)
print(envs.step(np.zeros(envs.action_space.shape, np.float32))[1].shape)
envs.close()
"""
CAN_FORK = pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork on this system")


@pytest.mark.parametrize("context", ["spawn", "forkserver"])
def test_processes_that_are_started_anew(context):
    jnp.zeros(1)  # JAX was used
    envs = gymnasium.make_vec(CHEETAH, 2, vectorization_mode="async", vector_kwargs={"context": context})
    alone = gymnasium.make(CHEETAH)
    observations, _ = envs.reset(seed=3)
    np.testing.assert_array_equal(observations[0], alone.reset(seed=3)[0])
    actions = np.full(envs.action_space.shape, 0.5, np.float32)
    observations, rewards, *_ = envs.step(actions)
    expected, reward, *_ = alone.step(actions[0])
    np.testing.assert_array_equal(observations[0], expected)
    assert rewards[0] == reward
    envs.close()


def forked(name, jax):
    command = [sys.executable, "-c", FORKED, name, jax]
    return subprocess.run(command, capture_output=True, text=True, timeout=120)


@CAN_FORK
@pytest.mark.parametrize("name", [CHEETAH, TRACKER])
def test_processes_that_are_forked_before_jax_is_used(name):
    done = forked(name, "unused")
    assert (done.stdout, done.returncode) == ("(2,)\n", 0)


@CAN_FORK
@pytest.mark.parametrize("name", [CHEETAH, TRACKER])
def test_a_process_that_is_forked_after_jax_was_used_says_so(name):
    done = forked(name, "used")
    assert done.returncode == 1
    assert "RebodyError: this process was forked after JAX was used" in done.stderr
    assert 'vector_kwargs={"context": "spawn"}' in done.stderr
