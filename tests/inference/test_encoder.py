"""The encoder's memory is exact, windowed or not, and it sees its fields and the reward alone."""

import equinox as eqx
import jax
import numpy as np
import pytest

from rebody.inference import Encoder
from rebody.inference.encoder import VARIANCE_RANGE
from rebody.types import DECISION_DT, GLOBAL_FIELDS, GlobalState, Transition, global_state

WINDOW, TIME = 5, 13
SEEN = ("x", "vx")


def make(**changes):
    settings = {"window": WINDOW, "latent": 2, "kinds": 0, "units": 8} | changes
    return eqx.filter_jit(lambda key: Encoder(fields=SEEN, scales=(10.0, 3.0), reward_scale=10.0, key=key, **settings))(
        jax.random.key(0)
    )


@pytest.fixture(scope="module")
def encoder():
    return make()


@pytest.fixture(scope="module")
def carried():
    """An encoder without a window."""
    return make(window=None)


@pytest.fixture(scope="module")
def walk():
    """Transitions [episode, time] of two episodes in which every field wanders."""
    rng = np.random.default_rng(0)
    states = {name: rng.normal(size=(2, TIME + 1)).cumsum(axis=1).astype(np.float32) for name in GLOBAL_FIELDS}
    return transitions_of(states, -np.abs(states["x"][:, 1:] - 3))


def transitions_of(states, reward):
    return Transition(
        GlobalState(**{name: values[:, :-1] for name, values in states.items()}),
        reward,
        GlobalState(**{name: values[:, 1:] for name, values in states.items()}),
    )


along = eqx.filter_jit(lambda encoder, transitions: encoder.along(transitions))


@eqx.filter_jit
def stepped(encoder, walk):
    """Beliefs [episode, time], one decision after the other."""

    def step(carry, transition):
        return encoder.step(carry, transition)

    time_first = jax.tree.map(lambda leaf: leaf.swapaxes(0, 1), walk)
    _, beliefs = jax.lax.scan(step, encoder.initial((2,)), time_first)
    return jax.tree.map(lambda leaf: leaf.swapaxes(0, 1), beliefs)


@pytest.fixture(scope="module")
def beliefs(encoder, walk):
    return stepped(encoder, walk)


def assert_same(belief, other):
    np.testing.assert_allclose(belief.mean, other.mean, rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(belief.variance, other.variance, rtol=1e-4, atol=1e-5)


def at(tree, *index):
    return jax.tree.map(lambda leaf: leaf[:, slice(*index)], tree)


def test_the_first_window_is_that_of_the_training(encoder, walk, beliefs):
    assert_same(at(beliefs, WINDOW), along(encoder, at(walk, WINDOW)))


@pytest.mark.parametrize("end", range(WINDOW, TIME + 1))
def test_later_beliefs_rest_on_the_last_window_alone(encoder, walk, beliefs, end):
    last = along(encoder, at(walk, end - WINDOW, end))
    assert_same(at(beliefs, end - 1, end), at(last, WINDOW - 1, WINDOW))


def test_what_is_older_than_the_window_is_forgotten(encoder, walk, beliefs):
    moved = eqx.tree_at(lambda w: w.reward, walk, np.where(np.arange(TIME) < 4, -7.0, walk.reward).astype(np.float32))
    again = stepped(encoder, moved)
    assert_same(at(again, 3 + WINDOW, None), at(beliefs, 3 + WINDOW, None))
    assert np.abs(again.mean - beliefs.mean)[:, : 3 + WINDOW].max(axis=(0, 2)).min() > 1e-4


def test_fields_that_are_not_among_its_own_do_not_reach_it(encoder, walk, beliefs):
    """A robot's pitch and height move where the toy's never did."""
    hidden = [name for name in GLOBAL_FIELDS if name not in SEEN]
    assert len(hidden) == len(GLOBAL_FIELDS) - 2
    moved = eqx.tree_at(
        lambda w: [getattr(state, name) for state in (w.previous, w.state) for name in hidden],
        walk,
        replace_fn=lambda leaf: leaf + 100,
    )
    np.testing.assert_array_equal(stepped(encoder, moved).mean, beliefs.mean)
    np.testing.assert_array_equal(stepped(encoder, moved).variance, beliefs.variance)


@pytest.mark.parametrize(
    "seen", [lambda w: w.reward, lambda w: w.state.x, lambda w: w.state.vx, lambda w: w.previous.x]
)
def test_reward_and_its_own_fields_do(encoder, walk, beliefs, seen):
    moved = eqx.tree_at(seen, walk, replace_fn=lambda leaf: leaf + 0.5)
    assert np.abs(stepped(encoder, moved).mean - beliefs.mean).max() > 1e-3


def test_features_by_hand(encoder):
    one = np.ones(1, np.float32)
    previous, state = (GlobalState(**dict.fromkeys(GLOBAL_FIELDS, one) | {"x": x}) for x in (2 * one, 3 * one))
    # x / 10, vx / 3, their changes per second, r / 10, compressed r / 10
    expected = [0.3, 1 / 3, 0.1 / DECISION_DT, 0.0, -0.4, 0.3 * np.arcsinh(-20)]
    np.testing.assert_allclose(encoder.features(Transition(previous, -4 * one, state)), [expected], rtol=1e-5)


def test_before_the_first_transition_it_believes_a_unit_gaussian(encoder):
    belief = encoder.prior((3,))
    np.testing.assert_array_equal(belief.mean, np.zeros((3, 2)))
    np.testing.assert_array_equal(belief.variance, np.ones((3, 2)))
    np.testing.assert_array_equal(belief.features()[0], [0, 0, 1, 1])


def test_variance_stays_in_its_range(encoder, walk):
    wild = eqx.tree_at(lambda w: w.reward, walk, walk.reward * 1e4)
    low, high = VARIANCE_RANGE
    variance = along(encoder, at(wild, WINDOW)).variance
    assert (variance >= 0.999 * low).all()
    assert (variance <= 1.001 * high).all()


def test_episodes_of_a_batch_do_not_mix(encoder, walk, beliefs):
    swapped = stepped(encoder, jax.tree.map(lambda leaf: leaf[::-1], walk))
    assert_same(swapped, jax.tree.map(lambda leaf: leaf[::-1], beliefs))


def test_without_a_window_a_belief_rests_on_the_whole_episode(carried, walk):
    assert carried.initial((2,)).hidden.shape == (2, 1, 8)
    assert_same(stepped(carried, walk), along(carried, walk))


def test_without_a_window_nothing_is_ever_forgotten(carried, walk):
    moved = eqx.tree_at(lambda w: w.reward, walk, np.where(np.arange(TIME) < 4, -70.0, walk.reward).astype(np.float32))
    apart = np.abs(stepped(carried, moved).mean - stepped(carried, walk).mean).max(axis=(0, 2))
    assert (apart > 1e-5).all()  # it fades, as nothing was learned


def test_both_begin_alike(carried, walk, beliefs):
    """The window makes no difference before it is full."""
    assert_same(at(stepped(carried, walk), WINDOW), at(beliefs, WINDOW))
    assert np.abs(stepped(carried, walk).mean - beliefs.mean)[:, WINDOW:].max() > 1e-4


def test_the_newest_features_gate_amounts_alone(walk):
    """With a head that says nothing, all that is left of the mean are the gates."""
    split = make(latent=3, kinds=1, window=None)
    assert split.gate.weights[-1].shape[1] == 2 * 6
    silent = eqx.tree_at(
        lambda e: (e.head.weights[-1], e.head.biases[-1]), split, replace_fn=lambda leaf: np.zeros_like(leaf)
    )
    mean = np.asarray(along(silent, walk).mean)
    assert not mean[..., 0].any()
    assert np.abs(mean[..., 1:]).max(axis=(0, 1)).min() > 1e-3


def test_gates_by_hand():
    """Amounts move by gate times feature, kinds do not move."""
    split = make(latent=3, kinds=1)
    rng = np.random.default_rng(0)
    hidden, features = rng.normal(size=(4, 8)).astype("f4"), rng.normal(size=(4, 6)).astype("f4")
    head = np.asarray(split.head(np.concatenate([hidden, features], axis=-1)))[:, :3]
    gates = np.asarray(split.gate(hidden)).reshape(4, 2, 6)
    expected = head + np.concatenate([np.zeros((4, 1)), (gates * features[:, None]).sum(-1)], axis=-1)
    np.testing.assert_allclose(split.belief(hidden, features).mean, expected, rtol=1e-4, atol=1e-5)


def test_a_split_latent_steps_as_it_was_trained(walk):
    for window in (None, TIME):
        split = make(latent=4, kinds=2, window=window)
        assert_same(stepped(split, walk), along(split, walk))


def heading_encoder(**changes):
    settings = {"window": WINDOW, "latent": 3, "kinds": 1, "units": 8} | changes
    return eqx.filter_jit(
        lambda key: Encoder(fields=("x", "yaw"), scales=(10.0, 2.0), reward_scale=10.0, key=key, **settings)
    )(jax.random.key(0))


def test_a_heading_is_seen_as_sine_and_cosine_and_turns_the_shorter_way():
    one = np.ones(1, np.float32)
    previous, state = (global_state(x=one, yaw=yaw * one) for yaw in (3.1, -3.1))
    turn = 2 * np.pi - 6.2
    # x / 10, sine and cosine, changes per second of x / 10 and yaw / 2, r / 10, compressed r / 10
    expected = [0.1, np.sin(-3.1), np.cos(-3.1), 0.0, turn / 2 / DECISION_DT, -0.4, 0.3 * np.arcsinh(-20)]
    found = heading_encoder().features(Transition(previous, -4 * one, state))
    np.testing.assert_allclose(found, [expected], rtol=1e-4, atol=1e-5)


def test_a_turn_more_changes_no_belief(walk):
    encoder, rng = heading_encoder(), np.random.default_rng(0)
    turned = eqx.tree_at(
        lambda w: [w.previous.yaw, w.state.yaw],
        walk,
        replace_fn=lambda yaw: yaw + (2 * np.pi * rng.integers(-2, 3, yaw.shape)).astype("f4"),
    )
    one, other = along(encoder, walk), along(encoder, turned)
    np.testing.assert_allclose(one.mean, other.mean, atol=1e-3)
    np.testing.assert_allclose(one.variance, other.variance, rtol=1e-2)
    half = eqx.tree_at(lambda w: w.state.yaw, walk, replace_fn=lambda yaw: yaw + np.float32(np.pi))
    assert np.abs(along(encoder, half).mean - one.mean).max() > 1e-3


def test_with_a_heading_it_steps_as_it_was_trained(walk):
    encoder = heading_encoder(window=TIME)
    assert_same(stepped(encoder, walk), along(encoder, walk))
