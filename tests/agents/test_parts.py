"""From artifacts to parts: what is loaded acts as what was saved."""

from dataclasses import asdict

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.agents.configs import InferenceSettings
from rebody.agents.parts import inference_template, load_flat, load_inference, load_step_predictor, load_tracker
from rebody.bodies.toys import FullToy, MassDamper, PositionToy, describe_toy
from rebody.control.flat import FlatView
from rebody.control.places import Place
from rebody.errors import RebodyError
from rebody.store import save_artifact, tree_hash, tree_to_arrays
from rebody.store.typed import typed
from rebody.tasks.line import GOAL, VELOCITY

X = np.linspace(-3, 3, 5, dtype=np.float32)
SLOTS = ("goal", "velocity")
PLACES = (Place(GOAL.quantity, (10.0,)), Place(VELOCITY.quantity, (3.0,)))


@pytest.fixture
def saved(inference, stored_config, tmp_path):
    """A function from changes of the parts' settings to the folder of an artifact."""

    def save(**changes):
        config = stored_config | {name: stored_config[name] | change for name, change in changes.items()}
        save_artifact(
            tmp_path / "module", kind="inference", config=config, weights=inference.parts, card="# Tiny\n", log=""
        )
        return str(tmp_path / "module")

    return save


def test_a_loaded_module_is_the_saved_one(inference, saved):
    loaded = load_inference(saved(toy={"max_force": 5.0}))
    assert tree_hash(loaded.parts) == tree_hash(inference.parts)
    assert eqx.filter(loaded.parts, lambda leaf: not eqx.is_array(leaf)) == eqx.filter(
        inference.parts, lambda leaf: not eqx.is_array(leaf)
    )
    assert loaded.contract == inference.contract
    assert loaded.toy == MassDamper(max_force=5.0)


def test_a_module_comes_with_the_toy_that_it_learned_on(saved, stored_config, monkeypatch):
    monkeypatch.setitem(stored_config, "toy", describe_toy(PositionToy(max_step=0.3)))
    assert load_inference(saved()).toy == PositionToy(max_step=0.3)
    with pytest.raises(RebodyError, match=r"unknown toy 'spring'\. Toys are: mass-damper, position"):
        load_inference(saved(toy={"kind": "spring"}))


def test_a_module_without_the_toys_oracle_is_not_understood(inference, stored_config, tmp_path):
    """As an earlier release made it."""
    arrays = {name: a for name, a in tree_to_arrays(inference.parts).items() if not name.startswith("told_policy")}
    save_artifact(tmp_path / "old", kind="inference", config=stored_config, weights=arrays, card="", log="")
    with pytest.raises(RebodyError, match="does not fit what is built here"):
        load_inference(str(tmp_path / "old"))


def test_a_module_of_other_sizes_is_refused(saved):
    with pytest.raises(RebodyError, match="does not fit what is built here"):
        load_inference(saved(high_level={"hidden": [9]}))


def test_a_contract_of_another_version_is_refused(saved):
    with pytest.raises(RebodyError, match="version 7"):
        load_inference(saved(contract={"version": 7}))


def test_a_loaded_tracker_acts_as_the_saved_one(tracker, tmp_path):
    config = {
        "robot": "cheetah", "observations": 23, "actions": 6, "hidden": [8], "projections": 0,
        "families": asdict(tracker.families),
    }  # fmt: skip
    save_artifact(tmp_path / "t", kind="tracker", config=config, weights=tracker, card="# Tiny\n", log="")
    loaded = load_tracker(str(tmp_path / "t"))
    observation = jax.random.normal(jax.random.key(0), (4, 23))
    np.testing.assert_array_equal(loaded.tracker.actor(observation), tracker.actor(observation))
    assert (loaded.robot, loaded.tracker.families) == ("cheetah", tracker.families)
    with pytest.raises(RebodyError):
        load_inference(str(tmp_path / "t"))


@pytest.mark.parametrize(
    ("said", "view"),
    [({}, FlatView(reach=10.0)), ({"places": [asdict(place) for place in PLACES]}, FlatView(PLACES, 10.0))],
)
def test_a_loaded_flat_policy_acts_as_the_saved_one(flat_policy, tmp_path, said, view):
    config = said | {
        "robot": "cheetah", "inference_hash": "abc", "reach": 10.0, "observations": 22, "actions": 6, "hidden": [8],
        "projections": 0,
    }  # fmt: skip
    save_artifact(tmp_path / "f", kind="flat", config=config, weights=flat_policy, card="# Tiny\n", log="")
    loaded = load_flat(str(tmp_path / "f"))
    assert tree_hash(loaded.policy) == tree_hash(flat_policy)
    assert (loaded.name, loaded.robot, loaded.inference_hash, loaded.policy.view) == ("f", "cheetah", "abc", view)
    save_artifact(tmp_path / "f", kind="flat", config={"robot": "cheetah"}, weights=flat_policy, card="", log="")
    with pytest.raises(RebodyError, match="settings of artifact 'f' are not understood"):
        load_flat(str(tmp_path / "f"))


def test_a_loaded_step_predictor_says_what_the_saved_one_does(step_predictor, tracker, tmp_path):
    config = {
        "robot": "cheetah", "tracker_hash": "abc", "observations": 23, "hidden": [8], "projections": 0,
        "families": asdict(tracker.families),
    }  # fmt: skip
    save_artifact(tmp_path / "s", kind="step-predictor", config=config, weights=step_predictor, card="", log="")
    loaded = load_step_predictor(str(tmp_path / "s"))
    assert tree_hash(loaded.predictor) == tree_hash(step_predictor)
    assert (loaded.name, loaded.robot, loaded.tracker_hash, loaded.predictor.families) == (
        "s", "cheetah", "abc", tracker.families,
    )  # fmt: skip
    with pytest.raises(RebodyError, match="'tracker' is needed"):
        load_tracker(str(tmp_path / "s"))
    save_artifact(tmp_path / "s", kind="step-predictor", config={}, weights=step_predictor, card="", log="")
    with pytest.raises(RebodyError, match="settings of artifact 's' are not understood"):
        load_step_predictor(str(tmp_path / "s"))


@pytest.mark.parametrize("kinds", [0, 2])
def test_a_module_is_loaded_with_its_mixture(kinds, stored_config, tmp_path):
    """All that the full toy brings along: three actions, a split latent, no window, a labeller, clusters."""
    config = stored_config | {
        "contract": stored_config["contract"] | {"window": None},
        "inference": {"units": 8, "window": None, "latent": 5, "kinds": kinds, "label_weight": 0.1},
        "mixture": {"maximum": 4},
        "toy": describe_toy(FullToy(max_torque=3.0)),
    }
    parts = eqx.filter_jit(lambda: inference_template(typed(config, InferenceSettings)))()
    active = np.arange(4) < 2
    parts = eqx.tree_at(
        lambda p: (p.mixture.active, p.mixture.mean),
        parts,
        (active, np.arange(4.0 * (kinds or 5), dtype="f4").reshape(4, -1)),
    )
    save_artifact(tmp_path / "full", kind="inference", config=config, weights=parts, card="", log="")
    loaded = load_inference(str(tmp_path / "full"))
    assert tree_hash(loaded.parts) == tree_hash(parts)
    assert loaded.parts.mixture.mean.shape == (4, kinds or 5)
    assert loaded.toy == FullToy(max_torque=3.0)
    assert loaded.contract.window is loaded.parts.module.encoder.window is None
    latent = jax.random.normal(jax.random.key(0), (3, kinds or 5))
    np.testing.assert_allclose(
        loaded.parts.mixture.responsibilities(latent), parts.mixture.responsibilities(latent), rtol=1e-6
    )
    # a split belief is seen as the share, the distance, the size and the doubt of the one field
    seen = 4 if kinds else 2 * 5
    assert loaded.parts.high_level.actor(jnp.zeros((1, 2 + seen))).shape == (1, 3)


def test_a_module_of_before_there_were_mixtures_has_none(saved, stored_config):
    assert "mixture" not in stored_config
    assert load_inference(saved()).parts.mixture is None


def test_what_does_not_fit_names_the_robot(inference):
    check_body = inference.contract.check_body
    check_body("cheetah", ("x", "vx"), SLOTS)
    with pytest.raises(RebodyError, match="sees x, which 'gripper' does not have"):
        check_body("gripper", ("z",), SLOTS)
    with pytest.raises(RebodyError, match="no slot for goal"):
        check_body("cheetah", ("x", "vx"), ("velocity",))


def test_the_tiny_parts_are_not_all_alike(inference):
    """Otherwise much of what is tested here would hold of anything."""
    observation = jnp.zeros((5, 6)).at[:, 0].set(X)
    assert np.ptp(inference.parts.high_level.actor(observation)) > 0.05
