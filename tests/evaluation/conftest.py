"""Synthetic episodes for what is computed from them."""

import numpy as np
import pytest

from rebody.evaluation.episode import EpisodeResult
from rebody.tasks import SHIPPED

VECTORS = ("active_target", "inferred_target", "subgoal")


def vectors(series):
    return [[each] if isinstance(each, float) else each for each in series]


@pytest.fixture(scope="session")
def result():
    """A function of a few figures -> the result of one episode; a number is a vector of one."""

    def make(**figures):
        time = 0.1 * np.arange(1, 31)
        quantities = dict.fromkeys(("x", "vx", "pitch", "vz"), time.tolist())
        figures = {name: vectors(value) if name in VECTORS else value for name, value in figures.items()}
        target = figures.get("target", 2.0)
        target = target if isinstance(target, list) else [target]
        given = {
            "families": SHIPPED, "family": "goal", "seed": 0, "switch": None, "time_s": time.tolist(),
            "quantities": quantities, "reward": time.tolist(),
            "active_family": ["goal"] * 30, "active_target": [target] * 30,
            "inferred_family": ["goal"] * 30, "inferred_target": [target] * 30, "cluster": [0] * 30,
            "latent": [[0.5, -0.5]] * 30, "subgoal_family": ["goal"] * 30, "subgoal": [[0.0]] * 30, "fell": False,
            "return_": -3.0, "oracle_return": -2.0, "idle_return": -4.0,
            "final_error": 0.1, "final_squared_error": 0.01, "ripple_m_s": 0.2,
        }  # fmt: skip
        return EpisodeResult(**(given | figures | {"target": target}))

    return make
