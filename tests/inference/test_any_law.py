"""Beliefs about a task and the law that it is paid by, on a body that wanders."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.agents.parts import load_inference
from rebody.inference.any_law import FIRST_SHARP, SharpenedByAnyLaw
from rebody.inference.normaliser import LARGEST, no_moments, normalised
from rebody.inference.profile import log_likelihoods
from rebody.inference.reader import PlaceReader
from rebody.inference.thinned import HEARD, nothing_heard
from rebody.types import Transition, global_state

TIME, TARGET = 45, np.array([4.0, -3.0])
FIELDS, SCALES = ("x", "y"), (10.0, 10.0)


@pytest.fixture(scope="module")
def inference():
    return load_inference("plane-any")


@pytest.fixture(scope="module")
def states():
    """A body that goes round a curve, its heading another one than its way."""
    time = 0.1 * np.arange(TIME + 1)
    x, y = 3.0 * np.sin(0.8 * time) + 0.4 * time, 2.0 * np.cos(1.1 * time) - 2.0
    vx, vy = (np.diff(each, prepend=each[0]) / 0.1 for each in (x, y))
    fields = {"x": x, "y": y, "vx": vx, "vy": vy, "yaw": np.sin(time)}
    return global_state(**{name: jnp.asarray(values, jnp.float32) for name, values in fields.items()})


LAWS = {
    "distance": lambda e: -e,
    "another scale and a bonus": lambda e: 5.0 - 0.2 * e,
    "squared": lambda e: 1.0 - 3.0 * e**2,
    "power": lambda e: -(e**1.5),
    "gaussian": lambda e: 3.0 * np.exp(-((e / 4.0) ** 2)) + 1.0,
}


@pytest.fixture(scope="module")
def belief_of(inference, states):
    """What is believed at the end of rewards [time, law], all laws at once."""
    module = inference.parts.module
    inferrer = SharpenedByAnyLaw(module.encoder, module.decoder)
    reader = PlaceReader(module.decoder, inference.contract.families)

    @eqx.filter_jit
    def believe(rewards):
        many = jax.tree.map(lambda leaf: jnp.broadcast_to(leaf[:, None], (TIME + 1, rewards.shape[1])), states)
        before, after = (jax.tree.map(lambda leaf: leaf[:-1], many), jax.tree.map(lambda leaf: leaf[1:], many))
        memory = inferrer.initial((rewards.shape[1],))

        def step(memory, transition):
            return inferrer.step(memory, transition)

        memory, beliefs = jax.lax.scan(step, memory, Transition(before, rewards, after))
        return inferrer.explained(memory), reader(beliefs)

    return believe


def test_a_place_is_found_whatever_way_it_is_paid(belief_of, states):
    far = np.hypot(np.asarray(states.x)[1:] - TARGET[0], np.asarray(states.y)[1:] - TARGET[1])
    rewards = np.stack([law(far) for law in LAWS.values()], axis=1).astype(np.float32)
    explained, (family, target) = jax.tree.map(np.asarray, belief_of(jnp.asarray(rewards)))
    for i, law in enumerate(LAWS):
        assert family[-1, i] == 0, law
        np.testing.assert_allclose(target[-1, i], TARGET, atol=0.05, err_msg=law)
    assert (explained > 0.99).all()
    assert FIRST_SHARP < TIME


def test_nothing_is_no_number_when_rewards_never_change(belief_of):
    explained, (_, target) = belief_of(jnp.zeros((TIME, len(LAWS))))
    assert np.isfinite(np.asarray(target)).all()
    assert np.isfinite(np.asarray(explained)).all()


def test_a_memory_keeps_what_differs():
    """On the way to a place each reward is kept, there they become one."""
    heard = nothing_heard((), 1, 2)
    way = np.concatenate([np.linspace(0.0, 1.0, 20), np.ones(100)])

    def take(heard, x):
        heard = heard.seeing(jnp.stack([x, 0.0 * x]))
        return heard.hearing(x - 1, heard.states[:, 0, 0] - 1, FIELDS, SCALES), None

    heard, _ = jax.lax.scan(take, heard, jnp.asarray(way, jnp.float32))
    assert float(heard.weights.sum()) == len(way)
    kept = np.asarray(heard.rewards)
    np.testing.assert_allclose(kept[:20], way[:20] - 1, atol=1e-6)
    assert (np.asarray(heard.weights)[:19] == 1).all()
    assert len(kept) == HEARD


def test_noise_is_averaged_where_a_body_stands():
    """Each entry is the mean of as many rewards as it has weight, with what is expected between its states added."""
    noise = np.random.default_rng(0).normal(0.0, 0.1, 400)
    way = np.concatenate([np.linspace(0.0, 1.0, 20), np.ones(380)])

    def take(heard, now):
        x, paid = now
        heard = heard.seeing(jnp.stack([x, 0.0 * x]))
        return heard.hearing(paid, heard.states[:, 0, 0], FIELDS, SCALES), None

    inputs = tuple(jnp.asarray(each, jnp.float32) for each in (way, way + noise))
    heard, _ = jax.lax.scan(take, nothing_heard((), 1, 2), inputs)
    off, weights = np.asarray(heard.rewards - heard.states[:, 0, 0]), np.asarray(heard.weights)
    assert weights @ off == pytest.approx(noise.sum(), abs=1e-2)
    assert abs(off[weights > 20]).max() < 0.05


def test_rewards_are_normalised_alike_along_and_one_by_one():
    rewards = jnp.asarray(np.random.default_rng(0).normal(5.0, 3.0, (2, 30)), jnp.float32)
    moments, each = no_moments((2,)), []
    for reward in rewards.T:
        moments = moments.hearing(reward)
        each.append(moments(reward))
    np.testing.assert_allclose(normalised(rewards), jnp.stack(each, axis=1), rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(normalised(7.0 * rewards + 100.0), normalised(rewards), atol=0.2)
    assert float(jnp.abs(normalised(rewards)).max()) <= LARGEST


def test_distances_explain_rewards_in_any_unit():
    distance = jnp.asarray(np.random.default_rng(1).uniform(0.1, 2.0, 16), jnp.float32)
    weight = jnp.ones(16)
    plain = log_likelihoods(distance, -distance, weight)
    np.testing.assert_allclose(log_likelihoods(distance, 4.0 - 7.0 * distance, weight), plain, atol=1e-3)
    assert int(jnp.argmax(plain)) == 0
    assert int(jnp.argmax(log_likelihoods(distance, -(distance**2), weight))) == 1
    np.testing.assert_allclose(
        log_likelihoods(distance, distance, weight), 0.0, atol=1e-2
    )  # paid for being far: no law
