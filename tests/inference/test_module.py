"""The loss against closed forms, that it can be learned, and what shapes the latent."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest
import scipy.stats

from rebody.errors import RebodyError
from rebody.inference import InferenceConfig, InferenceModule
from rebody.inference.decoder import Decoder, Prediction
from rebody.inference.module import FARTHEST_PLACE, Evidence, loss
from rebody.inference.prior import SplitPrior, unit_gaussian
from rebody.ranges import Box
from rebody.tasks import FamilySet, Quantity
from rebody.tasks.line import GOAL, LINE, STAND, VELOCITY
from rebody.types import Belief, Transition, global_state

CONFIG = InferenceConfig(window=6, units=32, batch_size=16, decoded=4)
UPDATES = 400
GOALS = FamilySet((GOAL,))
THREE = FamilySet((GOAL, VELOCITY, STAND))


def states(x):
    return global_state(x=x)


@pytest.fixture(scope="module")
def evidence():
    """Random walks around 2 m with a hidden goal at -5 or 5 m each: the rewards tell which."""
    rng = np.random.default_rng(0)
    goal = np.where(np.arange(CONFIG.batch_size) % 2, 5.0, -5.0)[:, None].astype(np.float32)
    x = (
        2 + 0.5 * rng.normal(size=goal.shape) + 0.2 * rng.normal(size=(len(goal), CONFIG.window + 1)).cumsum(1)
    ).astype("f4")
    before = rng.uniform(-6, 6, (len(goal), CONFIG.decoded)).astype(np.float32)
    action = rng.uniform(-1, 1, (*before.shape, 1)).astype(np.float32)
    after = before + 0.1 * action[..., 0]
    return Evidence(
        window=Transition(states(x[:, :-1]), -np.abs(x[:, 1:] - goal), states(x[:, 1:])),
        base_task=np.broadcast_to(goal > 0, (len(goal), CONFIG.window)).astype(np.int32),
        changed=np.zeros((len(goal), CONFIG.window, CONFIG.decoded), np.float32),
        previous=states(before),
        action=action,
        reward=-np.abs(after - goal),
        state=states(after),
    )


@pytest.fixture(scope="module")
def untrained():
    return eqx.filter_jit(lambda key: InferenceModule(CONFIG, GOALS, 1, key))(jax.random.key(0))


@pytest.fixture(scope="module")
def measured(evidence):
    """A compiled function of a module and its evidence."""
    return eqx.filter_jit(lambda module, evidence: loss(module, evidence, unit_gaussian, CONFIG, jax.random.key(1)))


@pytest.fixture(scope="module")
def trained(untrained, evidence):
    """The module after some updates on the same evidence."""
    optimiser = optax.adam(5e-3)
    arrays, static = eqx.partition(untrained, eqx.is_array)

    def update(carry, key):
        arrays, state = carry
        gradient = jax.grad(lambda a: loss(eqx.combine(a, static), evidence, unit_gaussian, CONFIG, key)[0])(arrays)
        updates, state = optimiser.update(gradient, state)
        return (eqx.apply_updates(arrays, updates), state), None

    @jax.jit
    def run(arrays):
        keys = jax.random.split(jax.random.key(2), UPDATES)
        return jax.lax.scan(update, (arrays, optimiser.init(arrays)), keys)[0][0]

    return eqx.combine(run(arrays), static)


def test_kl_to_the_unit_gaussian_in_closed_form():
    belief = Belief(np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 0.0]]), np.array([[1.0, 1.0], [1.0, 1.0], [np.e, 1.0]]))
    np.testing.assert_allclose(unit_gaussian(belief), [0.0, 4.5, 0.5 * (np.e - 2)], rtol=1e-6)


def test_kl_to_the_unit_gaussian_by_monte_carlo():
    belief = Belief(np.array([0.8, -1.5]), np.array([0.3, 2.0]))
    z = belief.mean + np.sqrt(belief.variance) * np.random.default_rng(0).normal(size=(200_000, 2))
    log_q = -0.5 * ((z - belief.mean) ** 2 / belief.variance + np.log(belief.variance)).sum(axis=-1)
    log_p = -0.5 * (z**2).sum(axis=-1)
    assert float(unit_gaussian(belief)) == pytest.approx((log_q - log_p).mean(), rel=0.01)


def test_the_prior_enters_the_loss_by_its_weight(untrained, evidence):
    config = replace(CONFIG, kl_weight=0.3)

    @eqx.filter_jit
    def compare(module):
        key = jax.random.key(1)
        with_prior, metrics = loss(module, evidence, unit_gaussian, config, key)
        without, _ = loss(module, evidence, lambda belief: jnp.zeros(belief.mean.shape[:-1]), config, key)
        return with_prior, without, metrics, unit_gaussian(module.encoder.along(evidence.window)).mean()

    with_prior, without, metrics, expected = compare(untrained)
    assert float(metrics["kl"]) == pytest.approx(float(expected), rel=1e-5)
    assert float(with_prior - without) == pytest.approx(0.3 * float(expected), rel=1e-4)


def test_training_lowers_loss_and_errors(untrained, trained, measured, evidence):
    before, errors_before = measured(untrained, evidence)
    after, errors_after = measured(trained, evidence)
    assert after < before - 0.1
    assert errors_after["reward_error"] < 0.5 * errors_before["reward_error"]
    assert errors_after["state_error"] < 0.5 * errors_before["state_error"]


def test_what_is_learned_is_the_task_of_the_window(trained, measured, evidence):
    """Told of the other goal's window, the decoder predicts the other goal's rewards."""
    other = eqx.tree_at(lambda e: e.window, evidence, jax.tree.map(lambda leaf: np.roll(leaf, 1, 0), evidence.window))
    right, wrong = (measured(trained, e)[1]["reward_error"] for e in (evidence, other))
    assert wrong > 3 * right


def made(families, fields, scales, latent, kinds):
    """A decoder of one action."""
    return eqx.filter_jit(lambda key: Decoder(families, fields, scales, 1, latent, kinds, 8, key=key))(
        jax.random.key(0)
    )


@pytest.fixture(scope="module")
def decoder():
    return made(GOALS, ("x", "vx"), (1.0, 1.0), latent=3, kinds=0)


def test_dynamics_do_not_shape_the_latent_and_rewards_do(decoder):
    latent, state = jnp.array([0.3, -0.2, 0.5]), jnp.array([0.4, 1.0])

    def next_state(latent):
        return decoder.next_state(state, jnp.ones(1), latent).sum()

    assert next_state(latent) != next_state(latent + 1)  # it sees the latent
    np.testing.assert_array_equal(jax.jit(jax.grad(next_state))(latent), np.zeros(3))
    assert np.abs(jax.jit(jax.grad(lambda z: decoder.reward(state, z).expectation))(latent)).min() > 0


def test_reward_is_a_weighted_distance_from_a_point_linear_in_the_latent(decoder):
    rng = np.random.default_rng(0)
    latent, state = rng.normal(size=(4, 3)).astype("f4"), rng.normal(size=(4, 2)).astype("f4")
    (expert,) = decoder.experts
    reference = latent @ expert.reference.weights[0] + expert.reference.biases[0]
    weights = jnp.log1p(jnp.exp(expert.weights(latent)))
    expected = -(weights * jnp.abs(state - reference)).sum(axis=-1)
    np.testing.assert_allclose(decoder.reward(state, latent).expectation, expected, rtol=1e-5)
    np.testing.assert_allclose(decoder.reward(reference, latent).expectation, np.zeros(4), atol=1e-6)
    assert len(expert.reference.weights) == 1


@pytest.fixture(scope="module")
def split_decoder():
    """Of a latent whose first two dimensions say what kind of task it is, and two for each field how much is asked."""
    return made(THREE, ("x", "vx", "pitch"), (1.0, 1.0, 1.0), latent=8, kinds=2)


def of_experts(decoder, state, amount):
    """What each expert says, by its own field and its own part of the amounts, [point, expert]."""
    said = []
    for i, expert in enumerate(decoder.experts):
        own = amount[:, 2 * i : 2 * i + 2]
        weight = jnp.log1p(jnp.exp(expert.weights(own)))
        said.append(-weight * jnp.abs(state[:, i : i + 1] - expert.reference(own)))
    return jnp.concatenate(said, axis=-1)


def points(fields, size=6):
    rng = np.random.default_rng(0)
    return rng.normal(size=(size, 8)).astype("f4"), rng.normal(size=(size, fields)).astype("f4")


def test_kinds_choose_among_the_fields_and_amounts_say_the_rest(split_decoder):
    latent, state = points(3)
    kind, amount = latent[:, :2], latent[:, 2:]
    choice = jax.nn.softmax(split_decoder.choice(kind), axis=-1)
    expected = (choice * of_experts(split_decoder, state, amount)).sum(axis=-1)
    np.testing.assert_allclose(split_decoder.reward(state, latent).expectation, expected, rtol=1e-5)


def test_kinds_that_choose_alike_are_paid_alike(split_decoder):
    """All that the kinds can do to the reward is to choose: without a choice they do nothing."""
    latent, state = points(3)
    other = np.concatenate([latent[:, :2] + 3.0, latent[:, 2:]], axis=-1)
    assert (
        np.abs(split_decoder.reward(state, latent).expectation - split_decoder.reward(state, other).expectation).max()
        > 1e-2
    )
    blind = eqx.tree_at(lambda d: d.choice.weights[-1], split_decoder, replace_fn=jnp.zeros_like)
    np.testing.assert_array_equal(blind.reward(state, latent).expectation, blind.reward(state, other).expectation)
    slope = jax.grad(lambda z: blind.reward(state, z).expectation.sum())(latent)
    assert not np.asarray(slope)[:, :2].any()
    assert np.abs(slope[:, 2:]).max(axis=0).min() > 1e-3


def test_amounts_have_no_part_in_the_choice(split_decoder):
    """How likely each field is the one is a matter of the kinds alone."""
    latent, state = points(3)

    def shares(latent):
        return np.exp(split_decoder.reward(state, latent).log_share)

    one = shares(latent)
    np.testing.assert_array_equal(shares(latent + np.array([0.0, 0.0, *6 * [0.7]], "f4")), one)
    assert np.abs(one - shares(latent + np.array([0.7, *7 * [0.0]], "f4"))).max() > 1e-2


def test_the_split_prior_is_the_weighted_sum_of_both():
    belief = Belief(np.array([[3.0, 1.0, -2.0], [0.0, 0.0, 0.0]]), np.array([[1.0, 1.0, 1.0], [1.0, np.e, np.e]]))
    np.testing.assert_allclose(SplitPrior(unit_gaussian, 1, 10.0)(belief), [47.5, np.e - 2], rtol=1e-6)
    np.testing.assert_allclose(SplitPrior(unit_gaussian, 2, 1.0)(belief), unit_gaussian(belief), rtol=1e-6)


def test_the_prior_of_the_kinds_sees_nothing_else():
    def squared_mean(belief):
        assert belief.mean.shape == belief.variance.shape == (5, 4, 2)
        return (belief.mean**2).sum(-1) + belief.variance.sum(-1)

    belief = Belief(np.arange(60.0).reshape(5, 4, 3), np.ones((5, 4, 3)))
    expected = 7 * ((belief.mean[..., :2] ** 2).sum(-1) + 2) + 0.5 * belief.mean[..., 2] ** 2
    np.testing.assert_allclose(SplitPrior(squared_mean, 2, 7.0)(belief), expected, rtol=1e-6)


slopes = eqx.filter_jit(
    lambda module, evidence, config: eqx.filter_grad(
        lambda m: loss(m, evidence, unit_gaussian, config, jax.random.key(1))[0]
    )(module)
)


def assert_same_slopes(module, evidence, other):
    for one, two in zip(*(jax.tree.leaves(slopes(module, e, CONFIG)) for e in (evidence, other)), strict=True):
        np.testing.assert_array_equal(one, two)


def paid(evidence, reward, changed):
    """The same, but the last transitions of each window are paid so, by a task that has changed with this chance."""
    is_other = np.arange(CONFIG.decoded) >= 2
    reward = np.where(is_other, reward, evidence.reward).astype("f4")
    chance = np.broadcast_to(np.where(is_other, changed, 0.0), evidence.changed.shape).astype("f4")
    return eqx.tree_at(lambda e: (e.reward, e.changed), evidence, (reward, chance))


def test_a_belief_need_not_explain_what_another_task_may_have_paid(untrained, evidence):
    """Where the task may have changed, rewards that it does not explain pull at nothing; else they do."""

    def pull(changed):
        far = [slopes(untrained, paid(evidence, reward, changed), CONFIG) for reward in (-77.0, -99.0)]
        return np.abs(far[0].encoder.cell.bias - far[1].encoder.cell.bias).max()

    assert pull(0.2) < 1e-6
    assert pull(0.0) > 1e-3


def test_the_error_is_the_mean_over_what_beliefs_explain(measured, untrained, evidence):
    """What another task paid is no error of theirs; where none can have, everything counts."""
    errors = {
        changed: float(measured(untrained, paid(evidence, -500.0, changed))[1]["reward_error"])
        for changed in (0.0, 0.2)
    }
    assert errors[0.0] > 3 * errors[0.2]


def test_the_state_is_predicted_from_the_last_belief_alone(trained, measured, evidence):
    """With an encoder that forgets at once, what comes earlier in a window does not reach its last belief."""
    cell = trained.encoder.cell
    forgets = cell.bias.at[cell.units : 2 * cell.units].set(-1e4)  # its update gates
    forgetful = eqx.tree_at(
        lambda m: (m.encoder.cell.from_hidden, m.encoder.cell.bias),
        trained,
        (jnp.zeros_like(cell.from_hidden), forgets),
    )

    def errors(changed):
        reward = np.where(changed, -9.0, evidence.window.reward).astype("f4")
        return measured(forgetful, eqx.tree_at(lambda e: e.window.reward, evidence, reward))[1]

    time = np.arange(CONFIG.window)
    as_it_was, early, last = errors(time < 0), errors(time < CONFIG.window - 2), errors(time == CONFIG.window - 1)
    assert early["state_error"] == as_it_was["state_error"] != last["state_error"]
    assert early["reward_error"] != as_it_was["reward_error"]  # which all beliefs have a part in


BASE_TASKS = THREE.base_tasks
LABELLED = replace(CONFIG, label_weight=0.5)


@pytest.fixture(scope="module")
def labelled():
    """It tells of three families, two directions each, though it sees x alone."""
    return eqx.filter_jit(lambda key: InferenceModule(LABELLED, THREE, 1, key))(jax.random.key(0))


@pytest.fixture(scope="module")
def with_labels():
    return eqx.filter_jit(
        lambda module, evidence, config: loss(module, evidence, unit_gaussian, config, jax.random.key(1))
    )


def test_labels_enter_the_loss_as_cross_entropy_by_their_weight(labelled, with_labels, evidence):
    """A labeller that is sure of the first base task whatever it sees."""
    logits = np.zeros(BASE_TASKS, "f4")
    logits[0] = 3.0
    sure = eqx.tree_at(
        lambda m: (m.labeller.weights[-1], m.labeller.biases[-1]), labelled, (np.zeros((2, BASE_TASKS), "f4"), logits)
    )
    surprise = np.log(np.exp(3.0) + BASE_TASKS - 1)  # nats of any other label
    without = with_labels(eqx.tree_at(lambda m: m.labeller, sure, None), evidence, LABELLED)[0]
    for label, expected in ((0, surprise - 3.0), (1, surprise), (5, surprise)):
        told = eqx.tree_at(lambda e: e.base_task, evidence, np.full_like(evidence.base_task, label))
        assert float(with_labels(sure, told, LABELLED)[0] - without) == pytest.approx(0.5 * expected, rel=1e-3)


def test_right_labels_lower_the_loss(labelled, with_labels, evidence):
    """A labeller that reads base task 0 or 1 from one dimension of a latent that varies widely."""
    lively = eqx.tree_at(lambda m: m.encoder.head.weights[-1], labelled, replace_fn=lambda w: 20 * w)
    mean = np.asarray(lively.encoder.along(evidence.window).mean)[..., 0]
    direction, threshold = np.array([-20.0, 20.0, 0, 0, 0, 0], "f4"), np.median(mean)
    reading = (
        np.stack([direction, 0 * direction]),
        -threshold * direction + np.array([0, 0, -99, -99, -99, -99], "f4"),
    )
    module = eqx.tree_at(lambda m: (m.labeller.weights[-1], m.labeller.biases[-1]), lively, reading)
    labels = (mean > threshold).astype(np.int32)
    right, half, wrong = (
        with_labels(module, eqx.tree_at(lambda e: e.base_task, evidence, told), LABELLED)[0]
        for told in (labels, np.where(np.arange(CONFIG.window) % 2, labels, 1 - labels), 1 - labels)
    )
    assert 0.4 < labels.mean() < 0.6
    assert right + 1 < half < wrong - 1


def test_labels_shape_the_encoder_and_only_where_they_are_used(labelled, untrained, evidence):
    other = eqx.tree_at(lambda e: e.base_task, evidence, 1 - evidence.base_task)
    one, two = (slopes(labelled, e, LABELLED).encoder.cell.bias for e in (evidence, other))
    assert np.abs(one - two).max() > 1e-5
    assert untrained.labeller is None
    assert_same_slopes(untrained, evidence, other)


def test_a_split_module_learns_what_kind_it_is_by_its_prior(evidence):
    """The kinds' divergence is weighted, the others' is not."""
    config = replace(CONFIG, latent=3, kinds=1, kl_weight=0.2)
    module = eqx.filter_jit(lambda key: InferenceModule(config, GOALS, 1, key))(jax.random.key(0))
    priors = [SplitPrior(unit_gaussian, 1, weight) for weight in (0.0, 5.0)]
    found = [eqx.filter_jit(loss)(module, evidence, prior, config, jax.random.key(1)) for prior in priors]
    belief = module.encoder.along(evidence.window)
    of_kind = unit_gaussian(Belief(belief.mean[..., :1], belief.variance[..., :1])).mean()
    assert float(found[1][1]["kl"] - found[0][1]["kl"]) == pytest.approx(5 * float(of_kind), rel=1e-4)
    assert float(found[1][0] - found[0][0]) == pytest.approx(0.2 * 5 * float(of_kind), rel=1e-3)


@pytest.mark.parametrize("experts", [1, 3])
def test_likelihood_of_a_prediction(experts):
    rng = np.random.default_rng(0)
    mean, value = rng.normal(size=(5, experts)), rng.normal(size=5)
    share, sigma = rng.dirichlet(np.ones(experts), size=5), rng.uniform(0.3, 2.0, 5)
    density = np.sum(share * scipy.stats.norm(mean, sigma[:, None]).pdf(value[:, None]), axis=-1)
    arrays = (a.astype("f4") for a in (mean, np.log(share), 2 * np.log(sigma)))
    found = Prediction(*arrays).log_likelihood(value.astype("f4"))
    np.testing.assert_allclose(found, np.log(density) + 0.5 * np.log(2 * np.pi), rtol=1e-4)


def test_experts_do_not_blend(split_decoder):
    """Each is paid for its own field alone, by its own amounts, whatever the kinds say."""
    latent, state = points(3)
    expected = of_experts(split_decoder, state, latent[:, 2:])
    np.testing.assert_allclose(split_decoder.reward(state, latent).mean, expected, rtol=1e-5)


def test_a_sure_belief_is_interpreted_as_its_field_and_the_reference(split_decoder):
    sure = eqx.tree_at(lambda d: d.choice.weights[0], split_decoder, replace_fn=lambda w: 300 * w)
    latent, _ = points(3)
    said = sure.interpret(Belief(latent, np.full_like(latent, 1e-12)))
    share, place = np.split(np.asarray(said.mean), 2, axis=-1)
    chosen = np.argmax(sure.choice(latent[:, :2]), axis=-1)
    np.testing.assert_allclose(share, np.eye(3)[chosen], atol=1e-4)
    reference = np.asarray(sure.places(latent[:, 2:]))
    np.testing.assert_allclose(place, reference, atol=1e-3)
    assert np.asarray(said.variance).max() < 1e-6


def test_doubt_is_interpreted_as_draws_would_be(split_decoder):
    """Of the reference exactly, of the share as well as a softmax of a Gaussian can be put in a formula."""
    rng, (latent, _) = np.random.default_rng(1), points(3)
    variance = rng.uniform(0.05, 0.5, latent.shape).astype("f4")
    said = split_decoder.interpret(Belief(latent, variance))
    draws = latent + np.sqrt(variance) * rng.standard_normal((20_000, *latent.shape)).astype("f4")
    share = np.asarray(jax.nn.softmax(split_decoder.choice(draws[..., :2]), axis=-1)).mean(axis=0)
    np.testing.assert_allclose(said.mean[:, :3], share, atol=0.02)
    spread = np.asarray(split_decoder.places(draws[..., 2:])).var(axis=0)
    np.testing.assert_allclose(said.variance[:, 3:], spread, rtol=0.05)


def test_a_belief_that_is_not_split_says_what_it_says(decoder):
    belief = Belief(np.ones((2, 3), "f4"), np.ones((2, 3), "f4"))
    assert decoder.interpret(belief) is belief


def test_families_share_the_amounts_of_a_split_latent_evenly():
    uneven = InferenceConfig(fields=("x", "vx"), scales=(1.0, 1.0), latent=5, kinds=2)
    with pytest.raises(RebodyError, match="leaves 3, which 2 families cannot share"):
        InferenceModule(uneven, FamilySet((GOAL, VELOCITY)), 1, jax.random.key(0))


def test_families_that_the_encoder_does_not_see_are_refused():
    split = InferenceConfig(fields=("x", "vx"), scales=(1.0, 1.0), latent=8, kinds=2)
    with pytest.raises(RebodyError, match=r"--inference.fields: x, vx, but families are about pitch as well"):
        InferenceModule(split, THREE, 1, jax.random.key(0))


def test_families_in_the_frame_of_the_heading_are_not_learned():
    along = replace(VELOCITY, quantity=replace(VELOCITY.quantity, frame="heading"))
    with pytest.raises(RebodyError, match="'velocity' is told in the frame of the heading, which no module learns"):
        InferenceModule(CONFIG, FamilySet((along,)), 1, jax.random.key(0))


def test_places_beyond_what_a_body_visits_cost(evidence, monkeypatch):
    """An account of any task by a place far away, from where all distances are alike, does not pay."""
    config = replace(CONFIG, kinds=1, latent=2)
    module = InferenceModule(config, GOALS, 1, jax.random.key(0))
    module = eqx.tree_at(
        lambda m: (m.decoder.experts[0].reference.weights[0], m.decoder.experts[0].reference.biases[0]),
        module,
        (jnp.zeros((1, 1)), jnp.full(1, -4.0)),
    )
    held = float(loss(module, evidence, unit_gaussian, config, jax.random.key(1))[0])
    monkeypatch.setattr("rebody.inference.module.FARTHEST_PLACE", 4.0)
    free = float(loss(module, evidence, unit_gaussian, config, jax.random.key(1))[0])
    assert held - free == pytest.approx((4.0 - FARTHEST_PLACE) ** 2, rel=1e-4)


# headings: as sine and cosine, and by the shorter way round

DOCK = replace(
    GOAL, name="dock", quantity=Quantity("x_yaw", ("x", "yaw"), "m, rad", "place and heading"),
    targets=(Box((-6.0, -3.0), (6.0, 3.0)),), directions=(),
)  # fmt: skip
FIELDS, SCALES = ("x", "vx", "yaw"), (10.0, 3.0, 2.0)


@pytest.fixture(scope="module")
def turning():
    """A decoder of goals and of places with a heading."""
    return made(FamilySet((GOAL, DOCK)), FIELDS, SCALES, latent=8, kinds=2)


def test_a_family_of_several_numbers_has_one_expert(turning):
    """Which is paid for the Euclidean distance in units of the scales, the heading by the shorter way round."""
    latent, state = points(3)
    amount, expert = latent[:, 5:], turning.experts[1]
    place = np.asarray(expert.place(amount))
    weight = np.log1p(np.exp(np.asarray(expert.weights(amount))))
    turn = (2.0 * (state[:, 2] - place[:, 1]) + np.pi) % (2 * np.pi) - np.pi
    distance = np.hypot(state[:, 0] - place[:, 0], turn / 2.0)
    np.testing.assert_allclose(turning.reward(state, latent).mean[:, 1], -weight[:, 0] * distance, rtol=1e-4)
    said = amount @ np.asarray(expert.reference.weights[0]) + np.asarray(expert.reference.biases[0])
    np.testing.assert_allclose(place, np.stack([said[:, 0], np.arctan2(said[:, 1], said[:, 2]) / 2.0], -1), rtol=1e-4)
    assert [len(each.fields) for each in turning.experts] == [1, 2]


def test_a_turn_more_is_none(turning):
    latent, state = points(3)
    once_more = state + np.array([0.0, 0.0, 2 * np.pi / SCALES[2]], "f4")
    for one, other in zip(
        jax.tree.leaves(turning.reward(state, latent)), jax.tree.leaves(turning.reward(once_more, latent)), strict=True
    ):
        np.testing.assert_allclose(one, other, atol=1e-4)
    action = np.zeros((6, 1), "f4")
    apart = turning.next_state(once_more, action, latent) - turning.next_state(state, action, latent)
    np.testing.assert_allclose(apart, np.tile([0, 0, np.pi], (6, 1)), atol=1e-4)


def test_a_heading_is_interpreted_as_draws_would_be(turning):
    """Where the belief is about as sure as one that has heard something."""
    rng, (latent, _) = np.random.default_rng(1), points(3)
    variance = rng.uniform(1e-4, 1e-3, latent.shape).astype("f4")
    said = turning.interpret(Belief(latent, variance))
    assert said.mean.shape == said.variance.shape == (6, 2 + 3)
    draws = latent + np.sqrt(variance) * rng.standard_normal((20_000, *latent.shape)).astype("f4")
    places = np.asarray(turning.places(draws[..., 2:]))
    mean = np.asarray(said.mean)[:, 2:]
    turns = np.pi * np.round((places[..., 2] - mean[:, 2]) / np.pi)  # scaled: half a turn's 2 pi / 2
    places = np.concatenate([places[..., :2], (places[..., 2] - turns)[..., None]], axis=-1)
    np.testing.assert_allclose(said.variance[:, 2:], places.var(axis=0), rtol=0.1)
    np.testing.assert_allclose(mean, places.mean(axis=0), atol=0.02)


def test_the_error_of_a_state_knows_no_turns():
    config = InferenceConfig(
        fields=FIELDS, scales=SCALES, window=6, units=8, batch_size=4, decoded=3, latent=6, kinds=2
    )
    module = eqx.filter_jit(lambda key: InferenceModule(config, FamilySet((GOAL, DOCK)), 1, key))(jax.random.key(0))
    rng = np.random.default_rng(0)

    def random_states(shape):
        return global_state(**{name: rng.uniform(-3, 3, shape).astype("f4") for name in FIELDS})

    window = Transition(random_states((4, 6)), rng.uniform(-3, 0, (4, 6)).astype("f4"), random_states((4, 6)))
    heard = Evidence(
        window, np.zeros((4, 6), np.int32), np.zeros((4, 6, 3), "f4"), random_states((4, 3)),
        np.zeros((4, 3, 1), "f4"), rng.uniform(-3, 0, (4, 3)).astype("f4"), random_states((4, 3)),
    )  # fmt: skip
    turned = eqx.tree_at(
        lambda e: [state.yaw for state in (e.window.previous, e.window.state, e.previous, e.state)],
        heard,
        replace_fn=lambda yaw: yaw + (2 * np.pi * rng.integers(-2, 3, yaw.shape)).astype("f4"),
    )
    measure = eqx.filter_jit(lambda evidence: loss(module, evidence, unit_gaussian, config, jax.random.key(1)))
    for one, other in zip(jax.tree.leaves(measure(heard)), jax.tree.leaves(measure(turned)), strict=True):
        assert float(one) == pytest.approx(float(other), rel=1e-3)


def test_there_are_logits_for_all_base_tasks():
    module = InferenceModule(replace(CONFIG, label_weight=0.1), LINE, 1, jax.random.key(0))
    assert module.labeller.weights[-1].shape == (2, 8)
