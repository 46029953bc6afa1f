import os
from pathlib import Path
cache = Path.home() / ".cache" / "rebody" / "jax-tests"
os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(cache))
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.2")
from jaxtyping import install_import_hook
install_import_hook("rebody", "beartype.beartype")
from dataclasses import asdict
import equinox as eqx, jax, numpy as np, pytest
from rebody.agents.configs import InferenceSettings
from rebody.agents.parts import Inference, LoadedFlat, LoadedTracker, inference_template
from rebody.bodies import load_robot
from rebody.bodies.toys import MassDamper
from rebody.control.flat import FlatPolicy, FlatView
from rebody.control.sac import Actor, SACConfig
from rebody.control.tracker import Tracker, command_inputs
from rebody.evaluation.evaluate import Trial
from rebody.inference.contract import Contract
from rebody.inference.probe import Probe
from rebody.ranges import interval
from rebody.store import tree_hash
from rebody.store.typed import typed
from rebody.tasks import FamilySet, SHIPPED
from rebody.tasks.line import GOAL, VELOCITY
WINDOW, SECONDS, JOINTS, ACTIONS = 6, 3.0, 17, 6
FS = FamilySet((GOAL.within(interval(-10., 10.), law="plain"),))
def lively(observations, seed, actions=ACTIONS):
    actor = eqx.filter_jit(Actor)(observations, actions, SACConfig(hidden=(8,)), jax.random.key(seed))
    return eqx.tree_at(lambda a: a.net.mlp.weights[-1], actor, replace_fn=lambda w: 10 * w)
@pytest.fixture(scope="session")
def stored_config():
    return {"contract": asdict(Contract(("x",), WINDOW, FS)), "inference": {"units": 8, "window": WINDOW, "latent": 2}, "high_level": {"fields": ["x", "vx"], "scales": [10.0, 3.5], "hidden": [8], "projections": 0}, "toy": {"kind": "mass-damper", "mass": 1.0, "damping": 2.0, "max_force": 7.0}}
@pytest.fixture(scope="session")
def inference():
    settings = typed({
        "contract": asdict(Contract(("x",), WINDOW, FS)),
        "inference": {"units": 8, "window": WINDOW, "latent": 2},
        "high_level": {"fields": ["x", "vx"], "scales": [10.0, 3.5], "hidden": [8], "projections": 0},
        "toy": {"kind": "mass-damper", "mass": 1.0, "damping": 2.0, "max_force": 7.0},
    }, InferenceSettings)
    parts = eqx.filter_jit(lambda: inference_template(settings))()
    weights = [parts.high_level.actor.net.mlp.weights[-1], parts.told_policy.actor.net.mlp.weights[-1]]
    probe = Probe(np.zeros((3, 1), np.float32), np.array([[2.0], [-1.0], [0.5]], np.float32), FS)
    parts = eqx.tree_at(lambda p: (p.high_level.actor.net.mlp.weights[-1], p.told_policy.actor.net.mlp.weights[-1], p.probe),
        parts, (*(30 * w for w in weights), probe))
    return Inference("tiny", settings.contract, parts, MassDamper())
@pytest.fixture(scope="session")
def trial(inference):
    fs = FamilySet((GOAL.within(interval(-5., 5.)), VELOCITY.within(interval(-3., 3.))))
    tracker = Tracker(lively(JOINTS + command_inputs(fs), 1), fs)
    flat = FlatPolicy(lively(JOINTS + 1 + 4, 2), FlatView(reach=10.0))
    return Trial(agent="reuse", inference=inference, families=SHIPPED, robot=load_robot("cheetah"),
        tracker=LoadedTracker("tiny-tracker", "cheetah", tracker),
        flat=LoadedFlat("tiny-flat", "cheetah", tree_hash(inference.parts.module), flat), seconds=SECONDS, horizon=5)
import rebody.tasks.bounds as _b
def _tp(family, ends, first, last):
    return [np.clip([low, high, *m, 0.0, -family.floor, family.floor], low, high) for low, high, m in zip(first, last, ends.T)]
_b._turning_points = _tp
import rebody.agents.doubts as _d
_orig = _d.RewardWatch._bounds
while hasattr(_orig, "__wrapped__"): _orig = _orig.__wrapped__
_d.RewardWatch._bounds = _orig
