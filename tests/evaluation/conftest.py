"""Synthetic episodes for what is computed from them."""

import numpy as np
import pytest

from rebody.evaluation.episode import EpisodeResult


@pytest.fixture(scope="session")
def result():
    """A function of a few figures -> the result of one episode."""

    def make(**figures):
        time = 0.1 * np.arange(1, 31)
        quantities = dict.fromkeys(("x", "vx", "pitch", "vz"), time.tolist())
        target = figures.get("target", 2.0)
        given = {
            "family": "goal", "target": target, "seed": 0, "switch": None, "time_s": time.tolist(),
            "quantities": quantities, "reward": time.tolist(),
            "active_family": ["goal"] * 30, "active_target": [target] * 30,
            "inferred_family": ["goal"] * 30, "inferred_target": [target] * 30, "cluster": [0] * 30,
            "latent": [[0.5, -0.5]] * 30, "subgoal_family": ["goal"] * 30, "subgoal": [0.0] * 30, "fell": False,
            "return_": -3.0, "oracle_return": -2.0, "idle_return": -4.0,
            "final_error": 0.1, "final_squared_error": 0.01, "ripple_m_s": 0.2,
        }  # fmt: skip
        return EpisodeResult(**(given | figures))

    return make
