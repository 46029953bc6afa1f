"""What each agent says, what it remembers, and that a subgoal is where the policy would lead a toy."""

from dataclasses import asdict, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.agents.agent import Observation
from rebody.agents.build import build_agent
from rebody.agents.clock import begin, decide
from rebody.agents.configs import InferenceSettings
from rebody.agents.kinds import KINDS
from rebody.agents.parts import Inference, inference_template
from rebody.bodies.toys import FullToy
from rebody.control.high_level import PolicyView
from rebody.control.places import Place
from rebody.errors import RebodyError
from rebody.inference.probe import fit_probe
from rebody.ranges import interval
from rebody.store.typed import typed
from rebody.tasks import SHIPPED, FamilySet
from rebody.tasks.line import GOAL, STAND, VELOCITY
from rebody.types import Belief, Task, Transition, global_state

SIZE, DECISIONS = 3, 8
BOTH = FamilySet((GOAL, VELOCITY))
"""Families in play where the tiny module's goals are not all; their indices:"""
OF_GOAL, OF_VELOCITY = 0, 1


def state_of(x, vx):
    """A robot there [m] at that speed [m/s], its other fields anything."""
    x, vx = np.asarray(x, np.float32), np.asarray(vx, np.float32)
    other = np.full_like(x, 0.7)
    return global_state(x=x, y=other, z=other, pitch=other, vx=vx, vy=other, vz=other, pitch_rate=other)


STATE = state_of([1.0, -4.0, 0.0], [2.0, 0.0, -1.0])
BELIEF = Belief(np.array([[0.5, -1.0], [2.0, 0.3], [0.0, 1.0]], np.float32), np.array([[0.5, 0.1]] * 3, np.float32))
BELIEF_FEATURES = np.concatenate([BELIEF.mean, np.sqrt(BELIEF.variance)], axis=-1)

say = eqx.filter_jit(lambda agent, state, belief, decision: agent.command(state, belief, decision))
FIRST = jnp.zeros((), jnp.int32)


def by_hand(inference, x, vx, horizon):
    """x of the mass-damper after following the policy, thesis (6.4-6.6)."""
    for _ in range(horizon):
        observation = np.concatenate([np.stack([x / 10.0, vx / 3.5], axis=-1), BELIEF_FEATURES], axis=-1)
        action = np.asarray(inference.parts.high_level.actor(observation.astype(np.float32)))[:, 0]
        vx = vx + 0.1 * (7.0 * action - 2.0 * vx) / 1.0
        x = x + 0.1 * vx
    return x


@pytest.mark.parametrize("horizon", [1, 5])
def test_a_subgoal_is_where_the_policy_would_lead_a_toy_from_here(inference, horizon):
    command = say(build_agent("reuse", inference, horizon=horizon), STATE, BELIEF, FIRST)
    expected = by_hand(inference, np.array(STATE.x), np.array(STATE.vx), horizon)
    assert np.abs(expected - STATE.x).min() > 0.01  # it goes somewhere
    np.testing.assert_allclose(command.subgoal.value[:, 0], expected, atol=1e-5)
    np.testing.assert_array_equal(command.subgoal.slot, [OF_GOAL] * SIZE)


def test_the_action_is_the_policys(inference):
    command = say(build_agent("reuse", inference), STATE, BELIEF, FIRST)
    np.testing.assert_allclose(command.action, inference.parts.high_level(STATE, BELIEF), rtol=1e-5)
    assert command.action.shape == (SIZE, 1)


def test_the_subgoal_comes_from_policy_and_dynamics_and_not_from_the_probe(inference):
    """Trap 1: the bridge is not a readout."""
    latent = np.random.default_rng(0).normal(size=(50, 2))
    probe = fit_probe(inference.contract.families, latent, np.zeros(50, int), 9.0 + latent[:, :1])
    probed = replace(inference, parts=eqx.tree_at(lambda p: p.probe, inference.parts, probe))
    subgoal = say(build_agent("reuse", probed), STATE, BELIEF, FIRST).subgoal
    np.testing.assert_array_equal(
        subgoal.value, say(build_agent("reuse", inference), STATE, BELIEF, FIRST).subgoal.value
    )
    assert np.abs(subgoal.value - probe(BELIEF)[1]).min() > 1.0

    elsewhere = say(build_agent("reuse", probed), state_of(STATE.x + 3, STATE.vx), BELIEF, FIRST).subgoal
    assert np.abs(elsewhere.value - subgoal.value).min() > 1.0  # the same belief
    other_policy = eqx.tree_at(
        lambda a: a.high_level.actor.net.mlp.biases[-1], build_agent("reuse", probed), np.ones(2)
    )
    assert np.abs(say(other_policy, STATE, BELIEF, FIRST).subgoal.value - subgoal.value).min() > 0.01
    other_toy = replace(probed, toy=replace(probed.toy, max_force=1.0))
    assert np.abs(say(build_agent("reuse", other_toy), STATE, BELIEF, FIRST).subgoal.value - subgoal.value).min() > 0.01


def test_one_decision_ahead_lies_within_the_toys_reach(inference):
    value = say(build_agent("reuse", inference, horizon=1), state_of(STATE.x, 0 * STATE.x), BELIEF, FIRST).subgoal.value
    assert np.abs(value[:, 0] - STATE.x).max() <= 0.07 + 1e-6  # 0.1 s * 0.1 s * 7 N / 1 kg


def test_readout_hands_on_what_is_read_and_acts_as_one_who_is_told_it(inference):
    command = say(build_agent("readout", inference), STATE, BELIEF, FIRST)
    family, target = inference.parts.probe(BELIEF)
    assert np.ptp(target) > 1.0
    assert_told(command, inference, family, target)


def test_bayes_hands_on_the_mode_and_acts_as_one_who_is_told_it(inference):
    modes = np.array([[0, 3.0], [0, -2.5], [0, 0.0]], np.float32)
    command = say(build_agent("bayes", inference), STATE, Belief(modes, 0 * modes), FIRST)
    assert_told(command, inference, np.zeros(SIZE), modes[:, 1:])


def assert_told(command, inference, family, target):
    np.testing.assert_array_equal(command.subgoal.slot, family)
    np.testing.assert_array_equal(command.subgoal.value, target)
    told = np.stack([np.ones(SIZE), np.asarray(target)[:, 0] / 10.0], axis=-1).astype(np.float32)
    acts = inference.parts.told_policy(STATE, Belief(told, 0 * told))
    np.testing.assert_allclose(command.action, acts, rtol=1e-5)
    assert np.ptp(acts) > 0.05


def test_reuse_is_no_readout(inference):
    """Trap 1: the same module, the same belief, another subgoal."""
    reused, read = (say(build_agent(kind, inference), STATE, BELIEF, FIRST) for kind in ("reuse", "readout"))
    assert np.abs(reused.subgoal.value - read.subgoal.value).min() > 0.1
    assert np.abs(reused.action - read.action).min() > 0.01


def test_a_flat_agent_says_nothing(inference):
    command = say(build_agent("flat", inference), STATE, BELIEF, FIRST)
    assert np.isnan(command.subgoal.value).all()
    assert np.isnan(command.action).all()


@pytest.fixture(scope="module")
def heard():
    """Observations [decision, episode] of a walk; the first is the start."""
    rng = np.random.default_rng(1)
    x = rng.normal(size=(DECISIONS + 1, SIZE)).cumsum(axis=0)
    return Observation(state_of(x, np.diff(x, axis=0, prepend=0) / 0.1), (-np.abs(x - 3)).astype(np.float32))


def listen(agent, heard):
    """Beliefs and commands, one per decision; the first before anything is known."""
    moments = [jax.tree.map(lambda leaf, i=i: leaf[i], heard) for i in range(DECISIONS + 1)]
    carry, command = begin(agent, moments[0].state)
    beliefs, commands = [carry.belief], [command]
    for moment in moments[1:]:
        carry, command = decide(agent, carry, moment)
        beliefs.append(carry.belief)
        commands.append(command)
    return jax.tree.map(lambda *steps: np.stack(steps), *zip(beliefs, commands, strict=True))


@pytest.mark.parametrize("stride", [3, 4])
def test_a_stride_holds_the_subgoal_while_the_encoder_ticks_on(inference, heard, stride):
    beliefs, commands = listen(build_agent("reuse", inference, stride=1), heard)
    same_beliefs, held = listen(build_agent("reuse", inference, stride=stride), heard)
    np.testing.assert_allclose(same_beliefs.mean, beliefs.mean, atol=1e-5)
    np.testing.assert_allclose(same_beliefs.variance, beliefs.variance, rtol=1e-4)
    spoken = stride * (np.arange(DECISIONS + 1) // stride)
    np.testing.assert_allclose(held.subgoal.value, commands.subgoal.value[spoken], atol=1e-5)
    np.testing.assert_allclose(held.action, commands.action[spoken], atol=1e-5)
    assert np.abs(np.diff(commands.subgoal.value, axis=0)).min() > 1e-3  # otherwise it speaks anew every time


def test_it_begins_with_the_prior_and_then_believes_what_the_encoder_does(inference, heard):
    beliefs, commands = listen(build_agent("reuse", inference), heard)
    np.testing.assert_array_equal(beliefs.mean[0], np.zeros((SIZE, 2)))
    np.testing.assert_array_equal(beliefs.variance[0], np.ones((SIZE, 2)))
    begins = jax.tree.map(lambda leaf: leaf[0], heard.state)
    unknown = Belief(np.zeros((SIZE, 2), np.float32), np.ones((SIZE, 2), np.float32))
    imagined = say(build_agent("reuse", inference), begins, unknown, FIRST)
    np.testing.assert_allclose(commands.subgoal.value[0], imagined.subgoal.value, atol=1e-5)
    assert np.abs(np.diff(beliefs.mean, axis=0)).max(axis=(1, 2)).min() > 1e-4


def test_the_oracle_says_the_active_target(inference, heard):
    family = np.repeat([[OF_GOAL, OF_VELOCITY, OF_GOAL]], DECISIONS, axis=0)
    target = np.repeat([[[4.0], [-1.5], [0.0]]], DECISIONS, axis=0).astype(np.float32)
    family[5:, 0], target[5:, 0] = OF_VELOCITY, 2.0  # another task from the sixth decision on
    beliefs, commands = listen(build_agent("oracle", inference, Task(family, target), families=BOTH), heard)
    np.testing.assert_array_equal(commands.subgoal.slot[:DECISIONS], family)
    np.testing.assert_array_equal(commands.subgoal.value[:DECISIONS], target)
    reused, _ = listen(build_agent("reuse", inference), heard)
    np.testing.assert_allclose(beliefs.mean, reused.mean, atol=1e-5)  # it listens
    told = np.stack([family[:, 2] == OF_GOAL, target[:, 2, 0] / 10.0], axis=-1).astype(np.float32)
    states = jax.tree.map(lambda leaf: leaf[:DECISIONS, 2], heard.state)
    acts = inference.parts.told_policy(states, Belief(told, 0 * told))
    np.testing.assert_allclose(commands.action[:DECISIONS, 2], acts, atol=1e-5)


@pytest.mark.parametrize("kind", ["readout", "flat"])
def test_what_the_module_believes_does_not_depend_on_who_acts(inference, heard, kind):
    beliefs, _ = listen(build_agent(kind, inference), heard)
    reused, _ = listen(build_agent("reuse", inference), heard)
    np.testing.assert_allclose(beliefs.mean, reused.mean, atol=1e-5)


def test_bayes_hears_the_same_and_knows_after_two_rewards(inference, heard):
    agent = build_agent("bayes", inference)
    _, commands = listen(agent, heard)
    np.testing.assert_array_equal(commands.subgoal.value[0], np.zeros((SIZE, 1)))
    np.testing.assert_allclose(commands.subgoal.value[3:], 3.0, atol=0.011)  # the goal of what was heard


@pytest.mark.parametrize(("families", "slot"), [(BOTH, 1), (SHIPPED.only(("stand", "jump", "goal")), 0)])
def test_the_idle_agent_stands_still(inference, heard, families, slot):
    """A speed of zero; where there is no slot for speeds, a jump being none, the rest pose."""
    _, commands = listen(build_agent("idle", inference, families=families), heard)
    np.testing.assert_array_equal(commands.subgoal.slot, np.full((DECISIONS + 1, SIZE), slot))
    np.testing.assert_array_equal(commands.subgoal.value, np.zeros((DECISIONS + 1, SIZE, 1)))


def test_an_agent_that_there_is_not(inference):
    with pytest.raises(
        RebodyError, match=rf"unknown agent 'resue'\. Did you mean 'reuse'\? Agents are: {', '.join(KINDS)}"
    ):
        build_agent("resue", inference)


def test_reuse_of_several_families_acts_by_the_policy_on_the_point_mass(inference):
    """A point mass has no slots, so nothing has to choose one."""
    contract = replace(inference.contract, families=BOTH)
    command = say(build_agent("reuse", replace(inference, contract=contract)), STATE, BELIEF, FIRST)
    np.testing.assert_allclose(command.action, inference.parts.high_level(STATE, BELIEF), rtol=1e-5)


@pytest.fixture(scope="module")
def standing(stored_config):
    """A module that learned to stand at a pitch, on the full toy."""
    families = FamilySet((STAND.within(interval(-1.5, 1.5), law="plain"),))
    seen = {"fields": ("x", "pitch"), "window": None, "families": asdict(families)}
    config = stored_config | {
        "contract": stored_config["contract"] | seen,
        "inference": {
            "units": 8,
            "window": None,
            "latent": 3,
            "kinds": 1,
            "fields": ("x", "pitch"),
            "scales": (9.0, 1.0),
        },
        "high_level": stored_config["high_level"] | {"fields": ["pitch", "pitch_rate"]},
        "toy": {"kind": "full", "max_torque": 6.0},
    }
    settings = typed(config, InferenceSettings)
    parts = eqx.filter_jit(lambda: inference_template(settings))()
    parts = eqx.tree_at(
        lambda p: [policy.actor.net.mlp.weights[-1] for policy in (p.high_level, p.told_policy)],
        parts,
        replace_fn=lambda w: 30 * w,
    )
    return Inference("standing", settings.contract, parts, FullToy(max_torque=6.0))


@pytest.mark.parametrize("kind", ["reuse", "readout", "bayes", "oracle", "idle"])
def test_an_action_has_as_many_numbers_as_the_toy_takes(standing, kind):
    tasks = Task(np.zeros((1, SIZE), int), np.ones((1, SIZE, 1), np.float32))
    _, command = eqx.filter_jit(build_agent(kind, standing, tasks).begin)(STATE)
    action = command.action
    assert action.shape == (SIZE, 3)
    assert np.isfinite(action).all()
    assert (kind == "idle") == (not np.asarray(action).any())


def test_a_subgoal_to_stand_is_the_pitch_that_the_full_toy_would_have(standing):
    state = replace(STATE, pitch=np.array([0.3, -1.0, 0.0], "f4"), pitch_rate=np.array([1.0, 0.0, -2.0], "f4"))
    belief = jax.tree.map(lambda part: np.concatenate([part, part[:, :1]], axis=-1), BELIEF)  # three dimensions
    command = say(build_agent("reuse", standing, horizon=4), state, belief, FIRST)
    x, vx, pitch, turn = (np.array(part) for part in (state.x, state.vx, state.pitch, state.pitch_rate))
    said = standing.parts.module.decoder.interpret(belief)
    for _ in range(4):
        here = replace(state, x=x, pitch=pitch, pitch_rate=turn)
        seen = PolicyView(("pitch", "pitch_rate"), (10.0, 3.5), (Place(STAND.quantity, (1.0,)),))(here, said)
        force, _, torque = (np.array([7.0, 0.0, 6.0]) * np.asarray(standing.parts.high_level.actor(seen))).T
        vx = (vx + 0.1 * (force - 2.0 * vx)).astype("f4")
        turn = (turn + 0.1 * (torque - 4.0 * turn - 4.0 * pitch)).astype("f4")
        x, pitch = x + np.float32(0.1) * vx, pitch + np.float32(0.1) * turn
    np.testing.assert_allclose(command.subgoal.value[:, 0], pitch, atol=1e-5)
    np.testing.assert_array_equal(command.subgoal.slot, [0] * SIZE)


def test_without_a_window_an_agent_believes_what_the_whole_episode_says(standing, heard):
    beliefs, _ = listen(build_agent("reuse", standing), heard)
    moments = jax.tree.map(lambda leaf: np.swapaxes(leaf, 0, 1), heard)
    before, after = (jax.tree.map(lambda leaf, s=s: leaf[:, s], moments.state) for s in (slice(-1), slice(1, None)))
    whole = standing.parts.module.encoder.along(Transition(before, moments.reward[:, 1:], after))
    np.testing.assert_allclose(beliefs.mean[1:], np.swapaxes(whole.mean, 0, 1), rtol=1e-4, atol=1e-5)
