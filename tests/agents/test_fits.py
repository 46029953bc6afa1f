"""Parts whose sizes are not those that a module and a robot need are refused, whatever their hashes say."""

from dataclasses import replace

import equinox as eqx
import jax
import numpy as np
import pytest

from rebody.agents.fits import check_predictor, check_sizes, check_slots
from rebody.agents.parts import LoadedHighLevel, LoadedSlots, LoadedStepPredictor, SlotParts
from rebody.agents.slots import SlotClassifier
from rebody.bodies.robot import Reach
from rebody.control.flat import FlatView
from rebody.control.high_level import PolicyView
from rebody.control.sac import Actor, SACConfig
from rebody.control.slot_policy import SlotPolicy
from rebody.errors import RebodyError
from rebody.nn import MLP
from rebody.tasks import GOAL, VELOCITY


def actor(observations, actions):
    return eqx.filter_eval_shape(lambda: Actor(observations, actions, SACConfig(hidden=(8,)), jax.random.key(0)))


@pytest.mark.parametrize(("actions", "said"), [(5, "gives 5, where 23 and 6"), (6, None)])
def test_a_tracker_moves_all_joints(trial, actions, said):
    other = replace(trial.tracker, tracker=eqx.tree_at(lambda t: t.actor, trial.tracker.tracker, actor(23, actions)))
    refused(said, check_sizes, other, trial.robot, trial.inference.parts.module.encoder)


@pytest.mark.parametrize(
    ("observations", "view", "said"),
    [
        (22, FlatView(reach=10.0), None),
        (21, FlatView(reach=10.0), "sees 21 numbers and gives 6, where 22 and 6"),
        (21, FlatView((("x", 10.0),)), "the places that it sees are not those"),
    ],
)
def test_a_flat_policy_sees_the_joints_and_the_belief(trial, observations, view, said):
    policy = replace(trial.flat.policy, actor=actor(observations, 6), view=view)
    other = replace(trial.flat, policy=policy)
    refused(said, check_sizes, other, trial.robot, trial.inference.parts.module.encoder)


@pytest.mark.parametrize(
    ("observations", "view", "said"),
    [
        (5, PolicyView(("x",), (10.0,)), None),
        (6, PolicyView(("x",), (10.0,)), "sees 6 numbers and gives 1, where 5 and 1"),
        (5, PolicyView(("x",), (10.0,), (("x", 1.0),)), "the places that it sees are not those"),
    ],
)
def test_a_high_level_policy_sees_the_belief(trial, observations, view, said):
    part = LoadedHighLevel("high", "cheetah", "", "", SlotPolicy(actor(observations, 1), view, ((GOAL, 5.0),)))
    refused(said, check_sizes, part, trial.robot, trial.inference.parts.module.encoder)


def test_a_step_predictor_sees_what_its_tracker_sees(trial, step_predictor):
    part = LoadedStepPredictor("steps", "cheetah", "", step_predictor)
    refused(None, check_predictor, part, trial.tracker)
    farther = replace(part, predictor=replace(step_predictor, reach=Reach(speed=(-9.0, 9.0))))
    refused("its reach is not that of its tracker", check_predictor, farther, trial.tracker)
    blind = replace(part, predictor=replace(step_predictor, actor=actor(22, 1)))
    refused("sees 22 numbers", check_predictor, blind, trial.tracker)


@pytest.mark.parametrize(
    ("latent", "families", "said"),
    [(2, (GOAL,), None), (3, (GOAL,), "its latent is not that of 'tiny'"), (2, (VELOCITY,), "its families are not")],
)
def test_a_classifier_knows_the_modules_latent_and_families(inference, latent, families, said):
    net = eqx.filter_eval_shape(lambda: MLP(latent, len(families), (), key=jax.random.key(0)))
    part = LoadedSlots("slots", "", SlotParts(SlotClassifier(net, families), np.zeros(0, np.int32)))
    refused(said, check_slots, part, inference)


def refused(said, check, *parts):
    if said is None:
        check(*parts)
    else:
        with pytest.raises(RebodyError, match=f"does not fit: .*{said}"):
            check(*parts)
