"""A tiny untrained module, policy and tracker: enough to tell whether the parts are put together rightly."""

import equinox as eqx
import jax
import pytest

from rebody.agents.parts import Inference, inference_template
from rebody.bodies import load_robot
from rebody.bodies.toys import MassDamper
from rebody.control.sac import Actor, SACConfig
from rebody.control.tracker import Tracker
from rebody.inference.contract import Contract

WINDOW = 6


@pytest.fixture(scope="session")
def stored_config():
    """What an inference artifact's config.json says of its parts."""
    return {
        "contract": Contract(("x",), WINDOW, {"goal": (-10.0, 10.0)}, "plain").to_config(),
        "inference": {"units": 8, "window": WINDOW, "latent": 2},
        "high_level": {"fields": ["x", "vx"], "scales": [10.0, 3.5], "hidden": [8], "projections": 0},
        "toy": {"mass": 1.0, "damping": 2.0, "max_force": 7.0},
    }


@pytest.fixture(scope="session")
def inference(stored_config):
    parts = eqx.filter_jit(lambda: inference_template(stored_config))()
    # a fresh policy hardly acts; this one does
    parts = eqx.tree_at(lambda p: p.high_level.actor.net.mlp.weights[-1], parts, replace_fn=lambda w: 30 * w)
    return Inference("tiny", Contract.from_config(stored_config["contract"]), parts, MassDamper())


@pytest.fixture(scope="session")
def cheetah():
    return load_robot("cheetah")


@pytest.fixture(scope="session")
def tracker():
    actor = eqx.filter_jit(Actor)(17 + 6, 6, SACConfig(hidden=(8,)), jax.random.key(1))
    actor = eqx.tree_at(lambda a: a.net.mlp.weights[-1], actor, replace_fn=lambda w: 10 * w)
    return Tracker(actor, 5.0, 3.0)
