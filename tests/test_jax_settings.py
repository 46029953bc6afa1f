"""What a user's program sets for its own JAX changes nothing here: the same tasks, beliefs and actions."""

import os
import subprocess
import sys

import pytest

SETTINGS = [
    ("jax_enable_x64", True),
    ("jax_default_prng_impl", "rbg"),
    ("jax_threefry_partitionable", False),
    ("jax_numpy_dtype_promotion", "strict"),
    ("jax_numpy_rank_promotion", "raise"),
    ("jax_debug_nans", True),
]
PROGRAM = """
import sys
import jax
for pair in sys.argv[1:]:
    name, value = pair.split("=")
    jax.config.update(name, {"True": True, "False": False}.get(value, value))
import gymnasium, rebody
module = rebody.load_inference("goal-velocity")
env = gymnasium.make("rebody/HalfCheetah-v0", families=module.contract.families)
toy = gymnasium.make_vec("rebody/PointMass-v0", num_envs=2, vectorization_mode="vector_entry_point")
agent = rebody.load_agent()
observation, info = env.reset(seed=1)
print(info["family"], info["target"], toy.reset(seed=3)[1]["target"])
reward = 0.0
for _ in range(12):
    observation, reward, *_ = env.step(agent.step(observation, reward))
belief = module.begin({"x": 0.0})
print(observation.round(4).tolist(), agent.inferred, belief.update({"x": 0.1}, -0.9).target)
print(toy.step(toy.action_space.sample() * 0 + 0.5)[0].tolist(), agent.status.mode)
"""


@pytest.fixture(scope="module")
def printed():
    """A function: settings of JAX -> what the program prints under them."""

    def run(*pairs: str) -> str:
        environment = os.environ | {"JAX_PLATFORMS": "cpu"}
        command = [sys.executable, "-c", PROGRAM, *pairs]
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout

    return run


@pytest.fixture(scope="module")
def usual(printed):
    return printed()


@pytest.mark.parametrize(("name", "value"), SETTINGS)
def test_the_same_under_any_setting(name, value, printed, usual):
    assert printed(f"{name}={value}") == usual


def test_the_same_under_all_at_once(printed, usual):
    assert printed(*(f"{name}={value}" for name, value in SETTINGS)) == usual
