"""Sharpened beliefs of the modules that ship: what they know, keep, notice and never do."""

import itertools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.agents.build import build_agent
from rebody.agents.parts import load_inference
from rebody.agents.rollout import rollout_on_toy
from rebody.agents.slots import SlotOfBelief
from rebody.inference.inputs import scaled
from rebody.inference.refine import Heard, Known, refine
from rebody.types import Belief, Task, Transition, global_state

DECISIONS = 80
TASKS = [("goal", 9.0), ("goal", -2.5), ("goal", -13.0), ("velocity", 1.2), ("velocity", -2.7), ("velocity", 2.0)]
OUTSIDE = [("goal", 22.0), ("goal", -19.0)]
"""Farther than the module was trained on."""


@pytest.fixture(scope="module")
def module():
    return load_inference("goal-velocity")


@pytest.fixture(scope="module")
def read(module):
    """A function (tasks, sharpen) -> what is read from beliefs on the toy: families and targets, [time, episode]."""
    families = module.contract.families

    def read(tasks, sharpen, kind="reuse"):
        family = np.tile(np.array([families.index(name) for name, _ in tasks], np.int32), (DECISIONS, 1))
        target = np.tile(np.array([target for _, target in tasks], np.float32), (DECISIONS, 1))
        agent = build_agent(kind, module, horizon=1, sharpen=sharpen)
        episodes = rollout_on_toy(agent, module.toy, Task(family, target[..., None]), families)
        which, where = agent.reader(episodes.belief)
        return np.asarray(which) == family, np.abs(np.asarray(where)[..., 0] - target), episodes

    return read


def test_targets_are_read_a_hundred_times_as_sharply(read):
    right, apart, _ = read(TASKS, sharpen=True)
    assert right[10:].all()
    assert apart[-20:].max() < 0.005  # m and m/s
    _, by_encoder, _ = read(TASKS, sharpen=False)
    assert np.median(by_encoder[-20:]) > 20 * np.median(apart[-20:])


def test_targets_beyond_what_was_learned(read):
    right, apart, _ = read(OUTSIDE, sharpen=True)
    assert right[20:].mean() > 0.95
    assert np.median(apart[-20:]) < 0.1


def test_the_error_is_known(read, module):
    """Deviations shrink with the errors, and are no smaller than a tenth of them."""
    _, apart, episodes = read(TASKS, sharpen=True)
    _, reader = module.believing(sharpen=True)
    deviations = [np.asarray(deviation)[..., 0] for _, deviation in reader.spreads(episodes.belief)]
    own = np.stack([deviations[module.contract.families.index(name)][:, i] for i, (name, _) in enumerate(TASKS)], 1)
    assert np.all(own[-1] < own[2])
    assert np.mean(apart[5:] < 10 * own[5:] + 1e-3) > 0.95


def at(x, vx):
    return global_state(x=np.asarray(x, np.float32), vx=np.asarray(vx, np.float32))


def heard(module, states, target=None, rewards=None, memory=None):
    """The belief after so many transitions along x, each of 0.1 s, of the goal; and the memory."""
    inferrer, reader = module.believing(sharpen=True)
    step = eqx.filter_jit(lambda memory, transition: inferrer.step(memory, transition))
    memory, belief = memory or inferrer.initial(), inferrer.prior()
    for i, (before, now) in enumerate(itertools.pairwise(states)):
        previous, state = at(before, 0.0), at(now, (now - before) / 0.1)
        reward = -abs(now - target) / max(abs(target), 1.0) if rewards is None else rewards[i]
        memory, belief = step(memory, Transition(previous, np.asarray(reward, np.float32), state))
    return memory, belief, reader


def test_who_stands_still_forgets_nothing(module):
    """A window of 3.2 s that holds one and the same reward does not say on which side the goal lies."""
    memory, belief, reader = heard(module, np.linspace(0, 5.8, 40), target=6.0)
    known = float(reader(belief)[1][0])
    assert known == pytest.approx(6.0, abs=0.01)
    _, belief, _ = heard(module, np.full(300, 5.8), target=6.0, memory=memory)
    assert float(reader(belief)[1][0]) == pytest.approx(known, abs=0.01)


def test_a_new_task_is_noticed(module):
    memory, _, _ = heard(module, np.linspace(0, 4, 40), target=9.0)
    _, belief, reader = heard(module, np.linspace(4, 3, 12), target=-5.0, memory=memory)
    family, target = reader(belief)
    assert module.contract.families[family].name == "goal"
    assert float(target[0]) == pytest.approx(-5.0, abs=0.5)


@pytest.mark.parametrize("rewards", [[0.0] * 40, [-1.0] * 40, [-900.0] * 40, [5.0, -7.0] * 20, [-1e6, 1e6] * 20])
def test_whatever_is_heard_the_belief_is_finite(module, rewards):
    for states in (np.zeros(41), np.linspace(0, 5, 41), np.linspace(0, 1e6, 41)):
        _, belief, reader = heard(module, states, rewards=rewards)
        assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves((belief, reader(belief)[1])))
        assert (np.asarray(belief.variance) > 0).all()


def test_a_refinement_never_ends_anywhere_worse(module):
    decoder, rng = module.parts.module.decoder, np.random.default_rng(0)
    state = global_state(x=jnp.linspace(0, 3, 32), vx=jnp.ones(32))
    encoder = module.parts.module.encoder
    for expert in decoder.experts:
        states = decoder.read(expert, scaled(state, encoder.fields, encoder.scales))
        rewards = jnp.asarray(-rng.uniform(0, 1, 32), jnp.float32)
        what = Heard(expert, states, rewards, jnp.arange(32) > 4)
        known = Known(jnp.zeros((2, 2)), jnp.zeros(2), jnp.zeros(2), jnp.full(2, 0.01))
        for start in jnp.asarray(rng.normal(size=(5, 2)), jnp.float32):
            ended = eqx.filter_jit(refine)(what, start, known)
            apart = rewards - expert(states, jnp.tile(start, (32, 1)))
            left = 0.5 * jnp.sum(what.is_heard * (apart / (2e-3 - 0.01 * rewards)) ** 2)
            assert ended.cost <= left * 1.001 + 0.5 * np.sum((0.01 * start) ** 2) + 1.0


def test_a_module_of_one_family_is_sharpened_too():
    position = load_inference("position")
    belief = position.begin({"x": 0.0}, sharpen=True)
    for x in np.linspace(0.05, 2.0, 40):
        reading = belief.update({"x": x}, -abs(x - 6.4))
    assert reading.target == (pytest.approx(6.4, abs=0.02),)


def test_a_module_without_a_place_keeps_its_beliefs(module):
    """One family, but an encoder that sees more than its quantity: no expert says a place."""
    contract = module.contract
    alone = eqx.tree_at(lambda m: m.decoder.choice, module.parts.module, None)
    without = type(module)("other", contract, eqx.tree_at(lambda p: p.module, module.parts, alone), module.toy)
    assert module.can_sharpen
    assert not without.can_sharpen
    assert without.believing(sharpen=True)[0] is without.parts.module.encoder


def test_slots_are_those_of_the_family_that_is_meant(module, read):
    choose = SlotOfBelief(module.parts.module.decoder)
    assert int(choose(module.parts.module.encoder.prior())) == 0  # nothing is known
    _, _, episodes = read(TASKS, sharpen=True)
    last = Belief(episodes.belief.mean[-1], episodes.belief.variance[-1])
    assert choose(last).tolist() == [module.contract.families.index(name) for name, _ in TASKS]
