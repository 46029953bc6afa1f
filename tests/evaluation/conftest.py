"""An untrained module and tracker put to the test, and synthetic episodes for what is computed from them."""

import equinox as eqx
import jax
import numpy as np
import pytest

from rebody.agents.parts import Inference, LoadedTracker, inference_template
from rebody.bodies import load_robot
from rebody.bodies.toys import MassDamper
from rebody.control.sac import Actor, SACConfig
from rebody.control.tracker import Tracker
from rebody.evaluation.evaluate import Trial
from rebody.evaluation.results import EpisodeResult
from rebody.inference.contract import Contract

SECONDS = 3.0


@pytest.fixture(scope="session")
def inference():
    contract = Contract(("x",), 6, {"goal": (-10.0, 10.0)}, "plain")
    config = {
        "contract": contract.to_config(),
        "inference": {"units": 8, "window": 6, "latent": 2},
        "high_level": {"fields": ["x", "vx"], "scales": [10.0, 3.5], "hidden": [8], "projections": 0},
    }
    parts = eqx.filter_jit(lambda: inference_template(config))()
    return Inference("tiny", contract, parts, MassDamper())


@pytest.fixture(scope="session")
def trial(inference):
    """`reuse` on the cheetah."""
    tracker = Tracker(eqx.filter_jit(Actor)(17 + 6, 6, SACConfig(hidden=(8,)), jax.random.key(1)), 5.0, 3.0)
    loaded = LoadedTracker("tiny-tracker", "cheetah", tracker)
    return Trial("reuse", inference, load_robot("cheetah"), loaded, seconds=SECONDS, horizon=5)


@pytest.fixture(scope="session")
def result():
    """A function of a few figures -> the result of one episode."""

    def make(**figures):
        time = 0.1 * np.arange(1, 31)
        steady = dict.fromkeys(("position_m", "velocity_m_s", "pitch_rad", "vz_max_m_s", "reward"), time.tolist())
        target = figures.get("target", 2.0)
        given = {
            "family": "goal", "target": target, "seed": 0, "switch": None, "time_s": time.tolist(), **steady,
            "active_family": ["goal"] * 30, "active_target": [target] * 30,
            "inferred_family": ["goal"] * 30, "inferred_target": [target] * 30, "cluster": [0] * 30,
            "latent": [[0.5, -0.5]] * 30, "subgoal_family": ["goal"] * 30, "subgoal": [0.0] * 30, "fell": False,
            "return_": -3.0, "oracle_return": -2.0, "final_error": 0.1, "final_squared_error": 0.01, "ripple_m_s": 0.2,
        }  # fmt: skip
        return EpisodeResult(**(given | figures))

    return make
