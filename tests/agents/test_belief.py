"""A belief that is told state and reward from outside is the agent's own."""

from dataclasses import asdict, replace

import equinox as eqx
import jax
import numpy as np
import pytest

import rebody
from rebody.agents.build import build_agent
from rebody.agents.configs import InferenceSettings
from rebody.agents.parts import Inference, inference_template, load_inference
from rebody.agents.rollout import rollout_on_toy
from rebody.bodies.toys import MassDamper
from rebody.errors import RebodyError
from rebody.ranges import Box
from rebody.store.typed import typed
from rebody.tasks import Direction, FamilySet, Quantity
from rebody.tasks.line import GOAL
from rebody.types import ANGLES, Task

DECISIONS = 9


def module_of(stored_config, *fields, **contract):
    """An untrained module that sees these fields."""
    config = stored_config | {
        "inference": stored_config["inference"] | {"fields": fields, "scales": (1.0,) * len(fields)},
        "contract": stored_config["contract"] | {"fields": fields} | contract,
    }
    settings = typed(config, InferenceSettings)
    parts = eqx.filter_jit(lambda: inference_template(settings))()
    return Inference("untrained", settings.contract, parts, MassDamper())


@pytest.fixture(scope="module", params=[False, True], ids=["as it is", "sharpened"])
def sharpen(request):
    return request.param


@pytest.fixture(scope="module")
def episodes(inference, sharpen):
    task = Task(np.zeros((DECISIONS, 1), np.int32), np.full((DECISIONS, 1, 1), 4.0, np.float32))
    agent = build_agent("reuse", inference, horizon=2, sharpen=sharpen)
    episodes = rollout_on_toy(agent, inference.toy, task, inference.contract.families)
    return jax.tree.map(lambda leaf: np.asarray(leaf)[:, 0], (episodes.state, episodes.reward, episodes.belief))


def test_believes_what_the_agent_did(inference, episodes, sharpen):
    belief, (state, reward, of_agent) = inference.begin({"x": 0.0}, sharpen), episodes
    for i in range(DECISIONS):
        reading = belief.update({"x": state.x[i]}, reward[i])
        assert reading is belief.reading
        np.testing.assert_allclose(reading.latent.mean, of_agent.mean[i], atol=1e-5)
        np.testing.assert_allclose(reading.latent.variance, of_agent.variance[i], atol=1e-5)
    assert (reading.family, reading.probabilities, reading.responsibilities) == ("goal", {"goal": 1.0}, {})
    if not sharpen:  # else its expert says it, not the probe
        assert reading.target == (pytest.approx(of_agent.mean[-1] @ [2.0, -1.0] + 0.5, abs=1e-4),)
    assert reading.base_tasks.keys() == {("goal", "back"), ("goal", "front")}
    assert sum(reading.base_tasks.values()) == pytest.approx(1.0, abs=1e-5)


def test_knows_nothing_at_the_beginning_and_each_is_its_own(inference):
    one, other = inference.begin({"x": 0.0}), inference.begin({"x": 0.0})
    one.update({"x": 0.1}, -3.0)
    np.testing.assert_array_equal(other.reading.latent.mean, np.zeros(2))
    np.testing.assert_array_equal(other.reading.latent.variance, np.ones(2))


@pytest.mark.parametrize(("position", "rate"), [("x", "vx"), ("z", "vz"), ("pitch", "pitch_rate")])
def test_a_velocity_that_is_left_out_is_the_displacement(position, rate, stored_config):
    module = module_of(stored_config, position, rate)
    told, left_out = module.begin({position: 0.2, rate: 0.0}), module.begin({position: 0.2})
    for before, now in ((0.2, 0.3), (0.3, 0.25), (0.25, 0.25)):
        of_told = told.update({position: now, rate: 10 * (now - before)}, -1.0)
        of_left_out = left_out.update({position: now, "family": "goal"}, -1.0)
        np.testing.assert_allclose(of_left_out.latent.mean, of_told.latent.mean, atol=1e-5)
    assert np.abs(of_told.latent.mean).max() > 0


@pytest.mark.parametrize("angle", ANGLES)
def test_an_angle_may_go_round(angle, stored_config):
    module = module_of(stored_config, angle, f"{angle}_rate")
    wrapped, unwrapped = module.begin({angle: 3.1}), module.begin({angle: 3.1})
    wrapped, unwrapped = wrapped.update({angle: 3.2 - 2 * np.pi}, -1.0), unwrapped.update({angle: 3.2}, -1.0)
    np.testing.assert_allclose(wrapped.latent.mean, unwrapped.latent.mean, atol=1e-5)


def test_of_several_families_and_clusters():
    belief = rebody.load_inference("goal-velocity").begin({"x": 0.0})
    for i in range(1, 20):
        reading = belief.update({"x": 0.1 * i}, -abs(0.1 * i - 6.0) / 6.0)
    assert reading.family == "goal"
    assert reading.target == (pytest.approx(6.0, abs=0.5),)
    assert list(reading.base_tasks) == [(name, side) for name in ("goal", "velocity") for side in ("back", "front")]
    assert reading.base_tasks["goal", "front"] > 0.9
    assert reading.probabilities.keys() == {"goal", "velocity"}
    assert reading.probabilities["goal"] > 0.9
    assert sum(reading.probabilities.values()) == pytest.approx(1.0, abs=1e-4)
    assert sum(reading.responsibilities.values()) == pytest.approx(1.0, abs=1e-4)


def test_of_places_with_a_heading(stored_config):
    """Numbers as the family has them, sectors as base tasks, the heading whatever turn it is told in."""
    sectors = tuple(Direction(name, (x, 0.0, y)) for name, x, y in (("east", 1.0, 0.0), ("north", 0.0, 1.0)))
    quantity = Quantity("x_yaw_y", ("x", "yaw", "y"), "m, rad", "place and heading")
    dock = replace(GOAL, name="dock", quantity=quantity, targets=(Box((-6.0,) * 3, (6.0,) * 3),), directions=sectors)
    module = module_of(stored_config, "x", "y", "yaw", "yaw_rate", families=asdict(FamilySet((dock, GOAL))))
    weights = np.random.default_rng(0).normal(size=(3, 5)).astype("f4")
    sure = np.array([[0, 0], [0, 0], [9, 0]], np.float32)  # of the first family
    parts = eqx.tree_at(lambda p: (p.probe.target_weights, p.probe.family_weights), module.parts, (weights, sure))
    one, other = (replace(module, parts=parts).begin({"x": 0.0, "y": 0.0, "yaw": 3.1}) for _ in range(2))
    reading = one.update({"x": 0.1, "y": 0.3, "yaw": -3.1}, -1.0)
    again = other.update({"x": 0.1, "y": 0.3, "yaw": 2 * np.pi - 3.1}, -1.0)
    np.testing.assert_allclose(reading.latent.mean, again.latent.mean, atol=1e-5)
    assert (reading.family, len(reading.target)) == ("dock", 3)
    x, sine, cosine, y = (reading.latent.mean @ weights[:2] + weights[2])[:4]
    assert reading.target == pytest.approx((x, np.arctan2(sine, cosine), y), abs=1e-5)
    assert list(reading.base_tasks) == [("dock", "east"), ("dock", "north"), ("goal", "back"), ("goal", "front")]
    assert sum(reading.base_tasks.values()) == pytest.approx(1.0, abs=1e-4)
    assert reading.probabilities["dock"] > 0.99


@pytest.mark.parametrize(
    ("state", "reward", "says"),
    [
        ({"x": 0.1}, float("nan"), r"decision 1: the reward is nan; give a finite number"),
        ({"x": 0.1}, 1e300, r"decision 1: the reward is 1e\+300; give a number of at most 1e\+06"),
        ({"x": 0.1}, "0.5", "the reward is '0.5'; give a number"),
        ({"x": 0.1}, np.zeros(2), r"the reward has shape \(2,\); give one number"),
        ({"x": float("inf")}, -1.0, "decision 1: the state's 'x' is inf"),
        ({"x": 3.4e38}, -1.0, "the state's 'x' is 3.4e"),
        ({"x": True}, -1.0, "the state's 'x' is True"),
        ({"vx": 1.0}, -1.0, "decision 1: the state lacks 'x': give x"),
        ([0.1], -1.0, "the state is of type list"),
    ],
)
def test_what_cannot_be_is_refused_and_not_taken_in(state, reward, says, inference):
    belief = inference.begin({"x": 0.0})
    before = belief.reading
    with pytest.raises(RebodyError, match=says):
        belief.update(state, reward)
    assert belief.reading is before
    other = inference.begin({"x": 0.0})
    np.testing.assert_array_equal(
        belief.update({"x": 0.1}, -3.0).latent.mean, other.update({"x": 0.1}, -3.0).latent.mean
    )


def test_what_was_not_heard_changes_no_belief(inference):
    belief, other = inference.begin({"x": 0.0}), inference.begin({"x": 0.0})
    belief.update({"x": 0.1}, -3.9)
    held = belief.update({"x": 0.3}, None)
    heard = belief.update({"x": 0.4}, -3.6)
    reading = other.update({"x": 0.1}, -3.9)
    np.testing.assert_array_equal(held.latent.mean, reading.latent.mean)
    assert not np.array_equal(heard.latent.mean, held.latent.mean)
    assert belief.doubts() == ()


def test_a_late_reward_can_be_for_a_state_in_which_nothing_was_heard():
    """Every second reward is lost, and each comes a decision late: all that is paid is paid for the states between."""
    belief = load_inference("goal-velocity-any").begin({"x": 0.0, "vx": 0.0}, sharpen=True)
    x = 4 * np.sin(0.15 * np.arange(60))
    for i in range(1, len(x)):
        reading = belief.update({"x": x[i], "vx": (x[i] - x[i - 1]) / 0.1}, None if i % 2 else 2 - abs(x[i - 1] - 3))
    assert reading.family == "goal"
    assert reading.target == pytest.approx((3.0,), abs=0.01)
    assert reading.explained == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("impossible", [7.0, 0.5])
def test_a_reward_that_no_task_pays_is_doubted_and_not_believed(impossible, inference):
    belief, other = inference.begin({"x": 0.0}), inference.begin({"x": 0.0})
    for reward in (-3.9, impossible, None):
        belief.update({"x": 0.1}, reward)
    other.update({"x": 0.1}, -3.9)
    np.testing.assert_array_equal(belief.reading.latent.mean, other.reading.latent.mean)
    (doubt,) = belief.doubts()
    assert f"the reward was {impossible:g} in 1 decision" in doubt


def test_a_velocity_needs_itself_or_its_position(stored_config):
    with pytest.raises(RebodyError, match="lacks 'vx': give vx, or x"):
        module_of(stored_config, "vx").begin({"z": 0.0})


def test_a_module_of_another_time_is_refused(stored_config):
    with pytest.raises(RebodyError, match=r"every 0\.05 s, here one takes 0\.1 s"):
        module_of(stored_config, "x", decision_dt=0.05).begin({"x": 0.0})
