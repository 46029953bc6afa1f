"""Before `rebody` is imported: JAX on the CPU with its compilation cache on, shapes and types checked.

Then what many tests share: tiny parts, most of them untrained, and command lines of tiny training runs.
"""

import os
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

cache = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "rebody" / "jax-tests"
os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(cache))
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.2")

from jaxtyping import install_import_hook  # noqa: E402

install_import_hook("rebody", "beartype.beartype")

import equinox as eqx  # noqa: E402
import jax  # noqa: E402
import numpy as np  # noqa: E402
import pytest  # noqa: E402

from rebody.agents.configs import InferenceSettings  # noqa: E402
from rebody.agents.parts import Inference, LoadedFlat, LoadedTracker, inference_template  # noqa: E402
from rebody.bodies import load_robot  # noqa: E402
from rebody.bodies.toys import MassDamper  # noqa: E402
from rebody.cli.main import run  # noqa: E402
from rebody.control.flat import FlatPolicy, FlatView  # noqa: E402
from rebody.control.sac import Actor, SACConfig  # noqa: E402
from rebody.control.step_predictor import StepPredictor  # noqa: E402
from rebody.control.tracker import Tracker  # noqa: E402
from rebody.evaluation.trial import Trial  # noqa: E402
from rebody.inference.contract import Contract  # noqa: E402
from rebody.inference.probe import Probe  # noqa: E402
from rebody.ranges import interval  # noqa: E402
from rebody.store import tree_hash  # noqa: E402
from rebody.store.typed import typed  # noqa: E402
from rebody.tasks import SHIPPED, FamilySet  # noqa: E402
from rebody.tasks.line import GOAL, VELOCITY  # noqa: E402

WINDOW, SECONDS = 6, 3.0
JOINTS, ACTIONS = 17, 6  # of a cheetah
HEARD = FamilySet((GOAL.within(interval(-10.0, 10.0), law="plain"),))
"""What the tiny module tells apart."""
COMMANDS = FamilySet((GOAL.within(interval(-5.0, 5.0)), VELOCITY.within(interval(-3.0, 3.0))))
"""What the tiny tracker can be commanded to do."""

MAPS = Path("/proc/self/maps")
MOST_MAPS = 20_000
"""Linux gives a process 65,530 memory maps, and crashes JAX's compiler where they run out. A compiled function takes
several, and test modules hardly share any: what one has compiled is let go before too many pile up."""


@pytest.fixture(autouse=True, scope="module")
def _few_memory_maps() -> Iterator[None]:
    yield
    if MAPS.exists() and MAPS.read_bytes().count(b"\n") > MOST_MAPS:
        jax.clear_caches()


# parts that nothing was learned for: enough to tell whether they are put together rightly


@pytest.fixture(scope="session")
def stored_config():
    """What an inference artifact's config.json says of its parts."""
    return {
        "contract": asdict(Contract(("x",), WINDOW, HEARD)),
        "inference": {"units": 8, "window": WINDOW, "latent": 2},
        "high_level": {"fields": ["x", "vx"], "scales": [10.0, 3.5], "hidden": [8], "projections": 0},
        "toy": {"kind": "mass-damper", "mass": 1.0, "damping": 2.0, "max_force": 7.0},
    }


@pytest.fixture(scope="session")
def inference(stored_config):
    settings = typed(stored_config, InferenceSettings)
    parts = eqx.filter_jit(lambda: inference_template(settings))()
    weights = [parts.high_level.actor.net.mlp.weights[-1], parts.told_policy.actor.net.mlp.weights[-1]]
    probe = Probe(np.zeros((3, 1), np.float32), np.array([[2.0], [-1.0], [0.5]], np.float32), HEARD)
    parts = eqx.tree_at(
        lambda p: (p.high_level.actor.net.mlp.weights[-1], p.told_policy.actor.net.mlp.weights[-1], p.probe),
        parts,
        (*(30 * w for w in weights), probe),  # fresh policies hardly act; these do
    )
    return Inference("tiny", settings.contract, parts, MassDamper())


@pytest.fixture(scope="session")
def cheetah():
    return load_robot("cheetah")


def lively_actor(observations: int, seed: int, actions: int = ACTIONS) -> Actor:
    actor = eqx.filter_jit(Actor)(observations, actions, SACConfig(hidden=(8,)), jax.random.key(seed))
    return eqx.tree_at(lambda a: a.net.mlp.weights[-1], actor, replace_fn=lambda w: 10 * w)


@pytest.fixture(scope="session")
def tracker():
    return Tracker(lively_actor(JOINTS + 6, 1), COMMANDS)


@pytest.fixture(scope="session")
def flat_policy():
    return FlatPolicy(lively_actor(JOINTS + 1 + 4, 2), FlatView(reach=10.0))


@pytest.fixture(scope="session")
def step_predictor(tracker):
    return StepPredictor(lively_actor(JOINTS + 6, 3, actions=1), tracker.families)


@pytest.fixture(scope="session")
def always(step_predictor):
    """A function: steps -> a predictor that always says so."""

    def always(steps):
        action = (steps - 0.5) / 10 - 1
        return eqx.tree_at(
            lambda p: (p.actor.net.mlp.weights[-1], p.actor.net.mlp.biases[-1]),
            step_predictor,
            (np.zeros((8, 2), np.float32), np.array([np.arctanh(action), 0.0], np.float32)),
        )

    return always


@pytest.fixture(scope="session")
def trial(inference, tracker, flat_policy, cheetah):
    """`reuse` on the cheetah; the flat policy is at hand."""
    return Trial(
        agent="reuse",
        inference=inference,
        families=SHIPPED,
        robot=cheetah,
        tracker=LoadedTracker("tiny-tracker", "cheetah", tracker),
        flat=LoadedFlat("tiny-flat", "cheetah", tree_hash(inference.parts.module), flat_policy),
        seconds=SECONDS,
        horizon=5,
    )


# artifacts that learned next to nothing, made by the command line itself

FLAGS = {
    "tracker": """
        train tracker cheetah --robots 4 --steps 4 --updates 2 --iterations 9 --replay 60
        --sac.hidden 8 8 --sac.batch-size 8
        --held-out 4 --held-out-s 3
    """,
    "inference": """
        train inference position --episodes 8 --decisions 24 --groups 2
        --wander-iterations 1 --joint-iterations 2 --policy-iterations 6 --inference-updates 2 --policy-updates 2
        --inference.units 8 --inference.window 4 --inference.batch-size 4 --inference.decoded 2
        --sac.hidden 8 8 --sac.projections 2 --sac.batch-size 8
        --prior mixture --mixture.from-iteration 1 --mixture.points 60
        --held-out 8 --held-out-at-end 8 --held-out-s 6
    """,
    "flat": """
        train flat --robot cheetah --robots 4 --steps 4 --updates 2 --iterations 9 --replay 60 --decisions 5
        --sac.hidden 8 8 --sac.projections 0 --sac.batch-size 8
        --held-out 3 --held-out-s 3
    """,
    "scratch": """
        train scratch --robot cheetah --robots 4 --decisions 6 --groups 2 --iterations 9
        --inference-updates 2 --policy-updates 2 --inference.units 8 --inference.window 4 --inference.batch-size 4
        --inference.decoded 2 --sac.hidden 8 8 --sac.projections 0 --sac.batch-size 8
        --held-out 4 --held-out-s 3
    """,
    "high-level": """
        train high-level --robot cheetah --robots 4 --steps 4 --updates 2 --iterations 9 --replay 60 --decisions 5
        --sac.hidden 8 8 --sac.projections 0 --sac.batch-size 8
        --held-out 3 --held-out-s 3
    """,
    "step-predictor": """
        train step-predictor --robot cheetah --robots 4 --steps 20 --updates 2 --iterations 9 --replay 60
        --sac.hidden 8 8 --sac.batch-size 8
        --held-out 8 --held-out-s 2
    """,
}
FULL = f"""
    {FLAGS["inference"].replace("position", "goal-velocity-stand")}
    --switch-share 0.5 --mixture.from-iteration 1 --mixture.maximum 6
    --inference.window None --inference.latent 5 --inference.kinds 2 --inference.label-weight 0.05
    --wander-iterations 1 --joint-iterations 2 --policy-iterations 1
"""
"""Beside those of `inference`, all that a module can have: three families, a carried state, a split latent, labels."""


@pytest.fixture(scope="session")
def own_module(tmp_path_factory) -> Path:
    """Folder of an inference module."""
    folder = tmp_path_factory.mktemp("trained") / "inference"
    assert run([*FLAGS["inference"].split(), "--out", str(folder)]) == 0
    return folder


@pytest.fixture(scope="session")
def own_tracker(own_module) -> Path:
    """Folder of a tracker."""
    folder = own_module.with_name("tracker")
    assert run([*FLAGS["tracker"].split(), "--out", str(folder)]) == 0
    return folder


@pytest.fixture(scope="session")
def full_module(tmp_path_factory) -> Path:
    """Folder of an inference module of the full toy."""
    folder = tmp_path_factory.mktemp("trained") / "full"
    assert run([*FULL.split(), "--out", str(folder)]) == 0
    return folder


@pytest.fixture(scope="session")
def tiny_training(own_module, own_tracker) -> dict[str, list[str]]:
    """Command lines of tiny runs without --out, by the kind of artifact that they make."""
    arguments = {kind: flags.split() for kind, flags in FLAGS.items()}
    hears, moves = ["--inference", str(own_module)], ["--tracker", str(own_tracker)]
    parts = {"flat": hears, "high-level": [*hears, *moves], "step-predictor": moves}
    return {kind: [*words, *parts.get(kind, [])] for kind, words in arguments.items()}


@pytest.fixture(scope="session")
def trained(own_module, tiny_training) -> dict[str, Path]:
    """Folders of a module, a tracker, the policies that hear that module, and that tracker's step predictor."""
    folders = {kind: own_module.with_name(kind) for kind in tiny_training}
    for kind in ("flat", "scratch", "high-level", "step-predictor"):
        assert run([*tiny_training[kind], "--out", str(folders[kind])]) == 0
    return folders
