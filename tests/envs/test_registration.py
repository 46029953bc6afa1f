"""Gymnasium knows the environments whichever is imported first."""

import subprocess
import sys

import gymnasium
import pytest
from gymnasium.envs.registration import EnvSpec

import rebody  # noqa: F401


@pytest.mark.parametrize(
    "imports",
    [
        "import rebody, gymnasium",
        "import gymnasium, rebody",
        "import gymnasium; gymnasium.make('rebody:rebody/PointMass-v0')",
    ],
)
def test_registered_in_any_order(imports):
    code = f"{imports}\nprint(*(name for name in gymnasium.registry if name.startswith('rebody/')), sep='\\n')"
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True)
    assert done.stderr == ""
    robots = ("HalfCheetah", "Hopper", "Walker2d")
    expected = {f"rebody/{robot}{what}-v0" for robot in robots for what in ("", "Tracker")} | {"rebody/PointMass-v0"}
    assert set(done.stdout.split()) == expected


@pytest.mark.parametrize("name", ["rebody/PointMass-v0", "rebody/HopperTracker-v0"])
def test_a_specification_survives_json(name):
    spec = gymnasium.spec(name)
    made = gymnasium.make(EnvSpec.from_json(spec.to_json()))
    assert made.reset(seed=0)[0] in made.observation_space
