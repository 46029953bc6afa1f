"""What is heard of what is earned: late, noisy, with gaps; on a toy and on the cheetah."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tests.conftest import HEARD

from rebody.agents import rollout
from rebody.agents.agent import Command, IdleAgent
from rebody.agents.build import build_agent
from rebody.agents.controller import TrackerController
from rebody.agents.payday import Payday, first_payday
from rebody.agents.rollout import joint_action, rollout_on_robot, rollout_on_toy
from rebody.tasks import Payment
from rebody.types import Belief, Task, Transition, global_state

DECISIONS = 8
STARTS = [2**63 + 7, 8, 9]
SEEDS = [start % 1000 for start in STARTS]
TARGETS = (3.0, -2.0, 8.0)


class Listener(eqx.Module):
    """Believes nothing but what it heard last: how many rewards and silences so far, reward, x before and after.

    What it counts by is one number for all episodes, as the ticks of an encoder are.
    """

    def initial(self, shape):
        return jnp.zeros(()), jnp.zeros(shape)

    def prior(self, shape):
        return Belief(jnp.zeros((*shape, 5)), jnp.ones((*shape, 5)))

    def step(self, memory, transition):
        ticks, silences = memory
        told = (ticks + 1, silences, transition.reward, transition.previous.x, transition.state.x)
        mean = jnp.stack(jnp.broadcast_arrays(*told), axis=-1)
        return (ticks + 1, silences), Belief(mean, jnp.ones_like(mean))

    def unheard(self, memory, transition):
        return memory[0], memory[1] + 1


class Pushing(IdleAgent):
    """Pushes a toy always alike."""

    def command(self, state, belief, decision):
        return Command(jnp.full((*state.x.shape, 1), 0.5), super().command(state, belief, decision).subgoal)


def tasks(targets=TARGETS):
    target = np.tile(np.array(targets, np.float32), (DECISIONS, 1))[..., None]
    return Task(np.zeros(target.shape[:2], np.int32), target)


@pytest.fixture(scope="module", params=["toy", "cheetah"])
def run(request, inference, tracker, cheetah):
    """A function (payment, starts, targets) -> episodes of an agent that only listens."""
    listening = Pushing(inferrer=Listener(), reader=inference.parts.probe, families=HEARD, stride=1, actions=1)

    def run(payment, starts=STARTS, targets=TARGETS, agent=listening):
        payday = first_payday(payment, starts)
        if request.param == "toy":
            return rollout_on_toy(agent, inference.toy, tasks(targets), HEARD, payday=payday)
        controller, seeds = TrackerController(tracker, HEARD), [start % 1000 for start in starts]
        return rollout_on_robot(agent, controller, cheetah, tasks(targets), HEARD, seeds, payday=payday)

    return run


def heard(episodes):
    """Ticks, silences before the last reward that was heard, that reward, x before and after; [time, episode] each."""
    return np.moveaxis(np.asarray(episodes.belief.mean), -1, 0)


def assert_same(tree, other):
    jax.tree.map(np.testing.assert_array_equal, tree, other)


def test_a_payment_without_gaps_is_a_law_like_any_other(run):
    own = run(None)
    assert_same(run(Payment()), own)  # the tiny module's families pay plainly
    np.testing.assert_allclose(run(Payment(scale=2.0, offset=1.0)).reward, 2 * own.reward + 1, rtol=1e-5)
    np.testing.assert_array_equal(heard(own)[2], own.reward)


def test_shares_and_sizes_are_those_that_were_asked_for():
    """Over 500 episodes of 40 decisions, each drawn apart."""
    nobody = Task(np.zeros(500, np.int32), np.zeros((500, 1), np.float32))
    state, still = global_state(x=np.zeros(500, np.float32)), np.zeros((1, 500, 1), np.float32)
    payday, pay = first_payday(Payment(dropped=0.4, noise=0.5), range(500)), eqx.filter_jit(Payday.pay)
    rewards, kept = [], []
    for _ in range(40):
        payday, _, reward, is_heard = pay(payday, HEARD, nobody, state, still)
        rewards.append(reward)
        kept.append(is_heard)
    rewards, kept = np.array(rewards), np.array(kept)
    assert 1 - kept.mean() == pytest.approx(0.4, abs=0.02)
    assert rewards[kept].std() == pytest.approx(0.5, abs=0.02)
    assert rewards[kept].mean() == pytest.approx(0.0, abs=0.02)
    assert np.corrcoef(kept[1:].ravel(), kept[:-1].ravel())[0, 1] == pytest.approx(0.0, abs=0.03)
    assert np.corrcoef(kept[:, 1:].ravel(), kept[:, :-1].ravel())[0, 1] == pytest.approx(0.0, abs=0.03)


@pytest.mark.parametrize("late", [1, 3])
def test_rewards_come_late(run, late):
    episodes = run(Payment(delay_s=late / 10))
    np.testing.assert_allclose(episodes.reward, -np.abs(episodes.state.x - np.array(TARGETS)), rtol=1e-5)
    ticks, silences, reward, before, x = heard(episodes)
    assert not ticks[:late].any()
    np.testing.assert_array_equal(ticks[late:, 0], np.arange(1, DECISIONS - late + 1))
    assert (silences[late:] == late).all()
    np.testing.assert_array_equal(reward[late:], episodes.reward[:-late])
    np.testing.assert_array_equal(x[late:], episodes.state.x[late:])  # states are never late
    np.testing.assert_array_equal(before[late:], episodes.state.x[late - 1 : -1])


def test_some_decisions_are_not_heard(run):
    episodes = run(Payment(dropped=0.4))
    ticks, silences, reward, _, x = heard(episodes)
    is_heard = np.diff(ticks, axis=0, prepend=0) > 0
    assert len(np.unique(is_heard, axis=1)[0]) > 1  # each episode its own
    np.testing.assert_array_equal(ticks, is_heard.cumsum(axis=0))
    np.testing.assert_array_equal(silences[is_heard], (~is_heard).cumsum(axis=0)[is_heard])
    np.testing.assert_array_equal(reward[is_heard], np.asarray(episodes.reward)[is_heard])
    np.testing.assert_array_equal(x[is_heard], np.asarray(episodes.state.x)[is_heard])
    assert_same(run(Payment(dropped=0.4)), episodes)


def test_noise_is_heard_and_not_earned(run):
    exact, noisy = run(Payment()), run(Payment(noise=0.5))
    np.testing.assert_array_equal(noisy.reward, exact.reward)  # a listener does nothing of it
    noise = heard(noisy)[2] - noisy.reward
    assert 0.3 < noise.std() < 0.7
    assert len(np.unique(noise)) == noise.size
    assert_same(run(Payment(noise=0.5)), noisy)


def test_noise_and_gaps_are_those_of_the_start_alone(run):
    payment = Payment(noise=0.5, dropped=0.3, delay_s=0.1)
    together, alone = run(payment), run(payment, STARTS[1:2], TARGETS[1:2])
    np.testing.assert_allclose(heard(alone)[:, :, 0], heard(together)[:, :, 1], atol=1e-4)
    other = run(payment, [start + 10 for start in STARTS])
    assert (heard(other)[2] != heard(together)[2]).any(axis=0).all()


def test_gaps_are_as_if_the_decisions_had_not_been(run, inference):
    """Of an encoder, which counts the ticks of all episodes as one where all are heard."""
    encoder, payment = inference.parts.module.encoder, Payment(dropped=0.4)
    is_heard = np.diff(heard(run(payment))[0], axis=0, prepend=0) > 0
    agent = Pushing(inferrer=encoder, reader=inference.parts.probe, families=HEARD, stride=1, actions=1)
    episodes, step = run(payment, agent=agent), eqx.filter_jit(encoder.step)
    x = np.concatenate([np.zeros((1, len(TARGETS)), np.float32), episodes.state.x])
    for i in range(len(TARGETS)):
        memory, belief = encoder.initial(), encoder.prior()
        for now in np.flatnonzero(is_heard[:, i]):
            before, after = (global_state(x=np.asarray(x[moment, i])) for moment in (now, now + 1))
            np.testing.assert_allclose(episodes.belief.mean[now - 1, i] if now else 0.0, belief.mean, atol=1e-4)
            memory, belief = step(memory, Transition(before, np.asarray(episodes.reward[now, i]), after))
            np.testing.assert_allclose(episodes.belief.mean[now, i], belief.mean, atol=1e-4)


def test_a_toys_action_costs(inference):
    agent = Pushing(inferrer=Listener(), reader=inference.parts.probe, families=HEARD, stride=1, actions=1)
    free, dear = (
        rollout_on_toy(agent, inference.toy, tasks(), HEARD, payday=first_payday(Payment(control_cost=cost), STARTS))
        for cost in (0.0, 0.4)
    )
    np.testing.assert_allclose(dear.reward, free.reward - 0.4 * 0.5**2, rtol=1e-5)


def test_joint_actions_cost_their_mean_over_a_decision(inference, tracker, cheetah, monkeypatch):
    agent, taken = build_agent("idle", inference), []

    def spy(*seen):
        taken.append(joint_action(*seen))
        return taken[-1]

    monkeypatch.setattr(rollout, "joint_action", spy)
    payday = first_payday(Payment(control_cost=0.4), STARTS)
    episodes = rollout_on_robot(agent, TrackerController(tracker, HEARD), cheetah, tasks(), HEARD, SEEDS, payday=payday)
    squares = (np.array(taken) ** 2).mean(axis=-1).reshape(DECISIONS, -1, len(TARGETS))
    plain = -np.abs(episodes.state.x - np.array(TARGETS))
    np.testing.assert_allclose(episodes.reward, plain - 0.4 * squares.mean(axis=1), rtol=1e-4)
    assert squares.mean() > 0.01
