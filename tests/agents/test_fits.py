"""Parts whose sizes are not those that a module and a robot need are refused, whatever their hashes say."""

from dataclasses import replace

import equinox as eqx
import jax
import numpy as np
import pytest

from rebody.agents.fits import check_predictor, check_sizes, check_slots
from rebody.agents.parts import LoadedHighLevel, LoadedSlots, LoadedStepPredictor, SlotParts
from rebody.agents.slots import SlotClassifier
from rebody.control.flat import FlatView
from rebody.control.high_level import PolicyView
from rebody.control.places import Place
from rebody.control.sac import Actor, SACConfig
from rebody.control.slot_policy import SlotPolicy
from rebody.errors import RebodyError
from rebody.nn import MLP
from rebody.ranges import interval
from rebody.tasks import FamilySet
from rebody.tasks.line import GOAL, VELOCITY

X, VX = GOAL.quantity, VELOCITY.quantity


def actor(observations, actions):
    return eqx.filter_eval_shape(lambda: Actor(observations, actions, SACConfig(hidden=(8,)), jax.random.key(0)))


@pytest.mark.parametrize(("actions", "said"), [(5, "gives 5, where 23 and 6"), (6, None)])
def test_a_tracker_moves_all_joints(trial, actions, said):
    other = replace(trial.tracker, tracker=eqx.tree_at(lambda t: t.actor, trial.tracker.tracker, actor(23, actions)))
    refused(said, check_sizes, other, trial.robot, trial.inference)


@pytest.mark.parametrize(
    ("observations", "view", "said"),
    [
        (22, FlatView(reach=10.0), None),
        (21, FlatView(reach=10.0), "sees 21 numbers and gives 6, where 22 and 6"),
        (21, FlatView((Place(X, (10.0,)),)), "the places that it sees are not those"),
    ],
)
def test_a_flat_policy_sees_the_joints_and_the_belief(trial, observations, view, said):
    policy = replace(trial.flat.policy, actor=actor(observations, 6), view=view)
    other = replace(trial.flat, policy=policy)
    refused(said, check_sizes, other, trial.robot, trial.inference)


@pytest.mark.parametrize(
    ("observations", "view", "slots", "said"),
    [
        (5, PolicyView(("x",), (10.0,)), (X,), None),
        (6, PolicyView(("x",), (10.0,)), (X,), "sees 6 numbers and gives 1, where 5 and 1"),
        (5, PolicyView(("x",), (10.0,), (Place(X, (1.0,)),)), (X,), "the places that it sees are not those"),
        (5, PolicyView(("x",), (10.0,)), (VX,), "its slots are not those of 'tiny'"),
        (5, PolicyView(("x",), (10.0,)), (X, VX), "its slots are not those of 'tiny'"),
    ],
)
def test_a_high_level_policy_sees_the_belief(trial, observations, view, slots, said):
    policy = SlotPolicy(actor(observations, 1), view, tuple(Place(quantity, (5.0,)) for quantity in slots))
    part = LoadedHighLevel("high", "cheetah", "", "", policy)
    refused(said, check_sizes, part, trial.robot, trial.inference)


def test_a_step_predictor_sees_what_its_tracker_sees(trial, step_predictor):
    part = LoadedStepPredictor("steps", "cheetah", "", step_predictor)
    refused(None, check_predictor, part, trial.tracker)
    families = FamilySet((GOAL, VELOCITY.within(interval(-9.0, 9.0))))
    farther = replace(part, predictor=replace(step_predictor, families=families))
    refused("its commands are not those of its tracker", check_predictor, farther, trial.tracker)
    blind = replace(part, predictor=replace(step_predictor, actor=actor(22, 1)))
    refused("sees 22 numbers", check_predictor, blind, trial.tracker)


@pytest.mark.parametrize(
    ("latent", "families", "said"),
    [
        (2, ("goal",), None),
        (3, ("goal",), "its latent is not that of 'tiny'"),
        (2, ("velocity",), "its families are not"),
        (2, ("goal", "velocity"), "its families are not"),
    ],
)
def test_a_classifier_knows_the_modules_latent_and_families(inference, latent, families, said):
    net = eqx.filter_eval_shape(lambda: MLP(latent, len(families), (), key=jax.random.key(0)))
    part = LoadedSlots("slots", "", families, SlotParts(SlotClassifier(net), np.zeros(0, np.int32)))
    refused(said, check_slots, part, inference)


def refused(said, check, *parts):
    if said is None:
        check(*parts)
    else:
        with pytest.raises(RebodyError, match=f"does not fit: .*{said}"):
            check(*parts)
