"""Rewards that no task which the module knows explains are told from those of known tasks, and said."""

from dataclasses import asdict

import equinox as eqx
import numpy as np
import pytest

import rebody
from rebody.agents.configs import InferenceSettings
from rebody.agents.doubts import RewardWatch
from rebody.agents.live import LiveAgent
from rebody.agents.parts import Inference, LoadedTracker, inference_template
from rebody.agents.unknown import ENOUGH, LEAST_EXPLAINED
from rebody.bodies.toys import MassDamper
from rebody.inference.contract import Contract
from rebody.store.typed import typed
from rebody.tasks import FamilySet
from rebody.tasks.line import GOAL
from rebody.types import global_state

DECISIONS = 60
PER_DECISION = 2
"""Control steps of the cheetah."""


@pytest.fixture(scope="module")
def module():
    """An untrained module: experts read places all the same, by amounts that mean nothing."""
    config = {
        "contract": asdict(Contract(("x", "vx"), 6, FamilySet((GOAL,)), any_law=True)),
        "inference": {
            **{"fields": ("x", "vx"), "scales": (10.0, 3.0), "window": 6, "units": 8},
            **{"latent": 3, "kinds": 1, "hears_any_law": True},
        },
        "high_level": {
            **{"fields": ("x", "vx"), "scales": (10.0, 3.5), "hidden": (8,), "projections": 0, "acts_by": "task"}
        },
        "toy": {"kind": "mass-damper", "mass": 1.0, "damping": 2.0, "max_force": 7.0},
    }
    settings = typed(config, InferenceSettings)
    return Inference(
        "untrained", settings.contract, eqx.filter_jit(lambda: inference_template(settings))(), MassDamper()
    )


def walk():
    """x, vx, height and turn rate of a body that goes to and fro."""
    ticks = np.arange(DECISIONS + 1)
    vx = 1.5 * np.sin(0.13 * ticks) + 0.3 * np.sin(ticks)
    height, turn = 0.5 + 0.1 * np.sin(0.7 * ticks), 0.6 * np.sin(0.45 * ticks + 1) + 0.3 * np.sin(1.9 * ticks)
    return 0.1 * np.cumsum(vx), vx, height, turn


def heard(module, pay):
    """The belief after a walk, and what was read at each decision."""
    x, vx, *others = walk()
    belief, chance = module.begin({"x": x[0], "vx": vx[0]}, sharpen=True), np.random.default_rng(0)
    readings = [
        belief.update({"x": x[i], "vx": vx[i]}, float(pay(x[i], vx[i], *(other[i] for other in others), chance)))
        for i in range(1, DECISIONS + 1)
    ]
    return belief, readings


KNOWN = {
    "goal": lambda x, vx, z, turn, chance: -abs(x - 3.0),
    "gaussian goal with a bonus": lambda x, vx, z, turn, chance: 3 * np.exp(-((x - 3.0) ** 2) / 4) + 1,
    "squared goal with noise": lambda x, vx, z, turn, chance: -2 * (x + 1.0) ** 2 + 0.1 * chance.normal(),
}
ALIEN = {
    "noise": lambda x, vx, z, turn, chance: chance.normal(),
    "skewed noise": lambda x, vx, z, turn, chance: chance.exponential(),
    "speed": lambda x, vx, z, turn, chance: -abs(vx - 1.2),
    "height": lambda x, vx, z, turn, chance: -abs(z - 0.8),
    "turn rate": lambda x, vx, z, turn, chance: 1 - (turn - 0.5) ** 2,
}


@pytest.mark.parametrize("pay", KNOWN.values(), ids=KNOWN)
def test_known_tasks_are_explained_whatever_way_they_are_paid(pay, module):
    belief, readings = heard(module, pay)
    assert all(reading.explained > 0.9 for reading in readings[ENOUGH:])
    assert belief.doubts() == ()
    assert (belief.believed, belief.unexplained) == (DECISIONS, 0)


@pytest.mark.parametrize("pay", ALIEN.values(), ids=ALIEN)
def test_alien_rewards_are_not(pay, module):
    belief, readings = heard(module, pay)
    assert all(0 <= reading.explained < LEAST_EXPLAINED for reading in readings[ENOUGH:])
    (doubt,) = belief.doubts()
    assert doubt.startswith(f"no task that the module knows explains the last {DECISIONS} rewards: only ")
    assert doubt.endswith(" % of their variance.")
    assert belief.unexplained == DECISIONS


def test_nothing_is_said_before_enough_was_heard(module):
    x, vx, *_ = walk()
    belief, chance = module.begin({"x": x[0], "vx": vx[0]}, sharpen=True), np.random.default_rng(0)
    said = []
    for i in range(1, ENOUGH + 1):
        belief.update({"x": x[i], "vx": vx[i]}, chance.normal())
        said.append(bool(belief.doubts()))
    assert said == [False] * (ENOUGH - 1) + [True]
    before = belief.reading
    assert belief.update({"x": x[i + 1], "vx": vx[i + 1]}, None) is before  # nothing heard, nothing new


def test_a_constant_reward_leaves_nothing_to_be_explained(module):
    belief, readings = heard(module, lambda *_: 7.0)
    assert readings[-1].explained == pytest.approx(1.0, abs=1e-3)
    assert belief.doubts() == ()


def test_any_reward_can_be_paid_to_a_module_that_hears_any_law(module):
    watch = RewardWatch(module.contract)
    states = [global_state(x=np.asarray(0.1 * i), vx=np.asarray(1.0)) for i in range(31)]
    for i in range(30):
        assert watch.hear(states[i], states[i + 1], 1e5)
    assert watch.doubts(np.inf) == watch.notes(np.inf) == ()


def test_modules_of_own_laws_and_beliefs_that_are_not_sharpened_do_not_know(inference, module):
    assert inference.begin({"x": 0.0}, sharpen=True).update({"x": 0.1}, -3.0).explained is None
    assert module.begin({"x": 0.0, "vx": 0.0}).update({"x": 0.1, "vx": 1.0}, -3.0).explained is None


@pytest.fixture
def status_after(cheetah, tracker, module):
    """A function: (step -> reward), options -> a cheetah's agent after enough decisions, and its status."""

    def run(pay, **options):
        agent = LiveAgent(cheetah, module, LoadedTracker("tiny", "cheetah", tracker), horizon=5, **options)
        for step in range(PER_DECISION * (ENOUGH + 1)):
            observation = np.zeros(18)
            observation[0] = 2 * np.sin(0.05 * step)
            assert np.isfinite(agent.step(observation, pay(step, observation[0]))).all()
        return agent, agent.status

    return run


@pytest.mark.parametrize("stands", [False, True])
def test_a_robot_that_does_not_know_may_stand_still(stands, status_after):
    noise = np.random.default_rng(0).normal(size=PER_DECISION * (ENOUGH + 1))
    agent, status = status_after(lambda step, x: noise[step], stands_when_unknown=stands)
    assert status.mode == ("standing still" if stands else "running")
    assert status.explained < LEAST_EXPLAINED
    assert [doubt.split(":")[0] for doubt in status.doubts] == [
        f"no task that the module knows explains the last {ENOUGH} rewards"
    ]
    if stands:
        assert (int(agent.subgoal.slot), agent.subgoal.value.tolist()) == (1, [0.0])
    agent.reset()
    assert (agent.status.mode, agent.status.explained) == ("running", None)


def test_a_robot_that_knows_runs(status_after):
    _, status = status_after(lambda step, x: 5 - 2 * abs(x - 4.0), stands_when_unknown=True)
    assert (status.mode, status.doubts) == ("running", ())
    assert status.explained > 0.9


def test_the_option_is_there_for_shipped_agents():
    agent = rebody.load_agent(stands_when_unknown=True)
    assert agent.status.explained is None  # a module of own laws
