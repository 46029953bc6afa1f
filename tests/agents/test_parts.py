"""From artifacts to parts: what is loaded acts as what was saved."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.agents.build import check_fit
from rebody.agents.parts import load_flat, load_inference, load_tracker
from rebody.errors import RebodyError
from rebody.store import save_artifact, tree_hash

X = np.linspace(-3, 3, 5, dtype=np.float32)


@pytest.fixture
def saved(inference, stored_config, tmp_path):
    """A function from changes of the parts' settings to the folder of an artifact."""

    def save(**changes):
        config = stored_config | {name: stored_config[name] | change for name, change in changes.items()}
        save_artifact(tmp_path / "module", kind="inference", config=config, weights=inference.parts, card="# Tiny\n", log="")
        return str(tmp_path / "module")

    return save


def test_a_loaded_module_is_the_saved_one(inference, saved):
    loaded = load_inference(saved(toy={"max_force": 5.0}))
    assert tree_hash(loaded.parts) == tree_hash(inference.parts)
    assert eqx.filter(loaded.parts, lambda leaf: not eqx.is_array(leaf)) == eqx.filter(
        inference.parts, lambda leaf: not eqx.is_array(leaf)
    )
    assert loaded.contract == inference.contract
    assert loaded.toy.max_force == 5.0


def test_a_module_of_other_sizes_is_refused(saved):
    with pytest.raises(RebodyError, match="does not fit what is built here"):
        load_inference(saved(high_level={"hidden": [9]}))


def test_a_contract_of_another_version_is_refused(saved):
    with pytest.raises(RebodyError, match="version 7"):
        load_inference(saved(contract={"version": 7}))


def test_a_loaded_tracker_acts_as_the_saved_one(tracker, tmp_path):
    config = {
        "robot": "cheetah", "observations": 23, "actions": 6, "hidden": [8], "projections": 0,
        "max_distance": 5.0, "max_speed": 3.0,
    }  # fmt: skip
    save_artifact(tmp_path / "t", kind="tracker", config=config, weights=tracker, card="# Tiny\n", log="")
    loaded = load_tracker(str(tmp_path / "t"))
    observation = jax.random.normal(jax.random.key(0), (4, 23))
    np.testing.assert_array_equal(loaded.tracker.actor(observation), tracker.actor(observation))
    assert (loaded.robot, loaded.tracker.max_distance, loaded.tracker.max_speed) == ("cheetah", 5.0, 3.0)
    with pytest.raises(RebodyError):
        load_inference(str(tmp_path / "t"))


def test_check_fit_names_the_robot(inference):
    check_fit(inference, "cheetah", ("x", "vx"))
    with pytest.raises(RebodyError, match="sees x, which 'gripper' does not have"):
        check_fit(inference, "gripper", ("z",))


def test_the_tiny_parts_are_not_all_alike(inference):
    """Otherwise much of what is tested here would hold of anything."""
    observation = jnp.zeros((5, 6)).at[:, 0].set(X)
    assert np.ptp(inference.parts.high_level.actor(observation)) > 0.05
