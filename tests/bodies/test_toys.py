"""The toys' arithmetic, and that each disturbance does what it says and nothing when it is off."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.bodies.toys import (
    FullToy,
    MassDamper,
    PositionToy,
    Randomisation,
    describe_toy,
    make_toy,
    no_disturbance,
)
from rebody.errors import RebodyError
from rebody.types import DECISION_DT, GLOBAL_FIELDS, GlobalState

FULL = FullToy()
TOYS = [MassDamper(), PositionToy(), FULL]
step = eqx.filter_jit(lambda toy, state, action, key: toy.step(state, action, key))


def roll(toy, actions, *, pitch=0.0, **disturbance):
    """States after each action of one toy that starts at rest; fields of its disturbance by name.

    An action is one number for all that a toy's action consists of, or all of them.
    """
    fields = tuple(disturbance)
    values = tuple(jnp.asarray(value, jnp.float32) for value in disturbance.values())
    nominal = no_disturbance(())
    state = toy.initial(
        jnp.zeros(()),
        jnp.zeros(()),
        eqx.tree_at(lambda d: tuple(getattr(d, field) for field in fields), nominal, values) if fields else nominal,
        pitch,
    )
    states = []
    for key, action in zip(jax.random.split(jax.random.key(0), len(actions)), actions, strict=True):
        state = step(toy, state, jnp.broadcast_to(jnp.asarray(action, jnp.float32), (toy.actions,)), key)
        states.append(state)
    return jax.tree.map(lambda *leaves: np.stack(leaves), *states)


def random_actions(steps=50):
    return np.random.default_rng(0).uniform(-1, 1, steps)


def full_actions(steps=50):
    """Force, lift and torque at random."""
    return np.random.default_rng(0).uniform(-1, 1, (steps, 3))


def test_terminal_speed_is_force_over_damping():
    assert roll(MassDamper(), [1.0] * 60).vx[-1] == pytest.approx(3.5, abs=1e-4)
    assert roll(MassDamper(), [-1.0] * 60).vx[-1] == pytest.approx(-3.5, abs=1e-4)


def test_mass_damper_by_hand():
    # v1 = 0.1 * 7 / 1 = 0.7; v2 = 0.7 + 0.1 * (7 - 2 * 0.7) = 1.26
    states = roll(MassDamper(), [1.0, 1.0])
    np.testing.assert_allclose(states.vx, [0.7, 1.26], rtol=1e-6)
    np.testing.assert_allclose(states.x, [0.07, 0.196], rtol=1e-6)


def test_position_toy_by_hand():
    np.testing.assert_allclose(roll(PositionToy(), [1.0, -0.5, 9.0]).x, [0.1, 0.05, 0.15], rtol=1e-6)


@pytest.mark.parametrize("toy", TOYS)
@pytest.mark.parametrize("ripple", [0.0, 0.5])
def test_velocity_is_displacement_over_time(toy, ripple):
    states = roll(toy, random_actions(), ripple_amplitude=ripple, ripple_period=0.37, ripple_phase=1.0)
    displacement = np.diff(states.x, prepend=0.0)
    np.testing.assert_allclose(displacement / DECISION_DT, states.vx, atol=2e-5)


def test_ripple_is_a_sine_on_the_velocity():
    actions = random_actions()
    plain, rippled = (
        roll(MassDamper(), actions, ripple_amplitude=a, ripple_period=0.5, ripple_phase=0.3) for a in (0, 0.4)
    )
    times = DECISION_DT * np.arange(1, len(actions) + 1)
    wave = 0.4 * np.sin(2 * np.pi * times / 0.5 + 0.3)
    np.testing.assert_allclose(rippled.vx - plain.vx, wave, atol=1e-4)
    np.testing.assert_array_equal(rippled.drift, plain.drift)


def test_lag_is_a_first_order_delay_of_the_force():
    # share of the difference made up in each step: dt / (dt + lag) = 1/4
    force = roll(MassDamper(), [1.0] * 3, lag=0.3).force
    np.testing.assert_allclose(force, 7 * (1 - 0.75 ** np.arange(1, 4)), rtol=1e-5)


@pytest.mark.parametrize("toy", TOYS)
def test_gain_weakens_the_action(toy):
    actions = random_actions()
    weak, half = roll(toy, actions, gain=0.5), roll(toy, 0.5 * actions)
    np.testing.assert_allclose(weak.x, half.x, atol=1e-5)


@pytest.mark.parametrize("toy", TOYS)
def test_noise_has_its_standard_deviation(toy):
    states = toy.initial(
        jnp.zeros(20_000),
        jnp.zeros(20_000),
        eqx.tree_at(lambda d: d.state_noise, no_disturbance((20_000,)), jnp.full(20_000, 0.2)),
    )
    after = step(toy, states, jnp.zeros((20_000, toy.actions)), jax.random.key(1))
    noise_of_x = np.asarray(after.x - DECISION_DT * after.vx)
    assert noise_of_x.mean() == pytest.approx(0.0, abs=0.01)
    assert noise_of_x.std() == pytest.approx(0.2, rel=0.03)
    assert np.asarray(after.drift).std() == pytest.approx(0.2 if isinstance(toy, MassDamper) else 0, rel=0.03)


@pytest.mark.parametrize("toy", TOYS)
def test_a_nominal_toy_does_not_depend_on_the_key(toy):
    state, action = toy.initial(jnp.ones(3), jnp.ones(3)), jnp.ones((3, toy.actions))
    one, other = (step(toy, state, action, jax.random.key(seed)) for seed in (0, 1))
    jax.tree.map(np.testing.assert_array_equal, one, other)
    np.testing.assert_array_equal(one.vx, one.drift)
    np.testing.assert_array_equal(one.pitch_rate, one.turn)


def test_randomisation_stays_in_its_ranges():
    drawn = Randomisation(state_noise=0.04).sample(jax.random.key(0), (1000,))
    for values, low, high in [
        (drawn.ripple_amplitude, 0.0, 0.6),
        (drawn.ripple_period, 0.2, 0.8),
        (drawn.pitch_ripple, 0.0, 1.0),
        (drawn.lag, 0.0, 0.5),
        (drawn.gain, 0.5, 1.0),
    ]:
        assert low <= values.min() < low + 0.05 * (high - low)
        assert high >= values.max() > high - 0.05 * (high - low)
    np.testing.assert_allclose(drawn.state_noise, 0.2, rtol=1e-6)
    parts = np.stack(jax.tree.leaves(drawn))
    apart = np.corrcoef(parts[parts.std(axis=1) > 1e-6]) - np.eye(6)
    assert np.abs(apart).max() < 0.15  # each is drawn for itself


@pytest.mark.parametrize("toy", TOYS)
@pytest.mark.parametrize("shape", [(), (3,), (2, 3)])
def test_any_batch_shape(toy, shape):
    state = toy.initial(jnp.zeros(shape), jnp.zeros(shape), Randomisation().sample(jax.random.key(0), shape))
    after = step(toy, state, jnp.ones((*shape, toy.actions)), jax.random.key(0))
    observed = toy.observe(after)
    assert isinstance(observed, GlobalState)
    assert all(leaf.shape == shape for leaf in jax.tree.leaves(observed))


FULL_REST = 100  # decisions after which nothing moves any more


def test_one_action_for_each_thing_that_a_toy_can_do():
    assert [toy.actions for toy in TOYS] == [1, 1, 3]
    assert [toy.max_pitch for toy in TOYS] == [0.0, 0.0, 2.25]


def test_along_x_the_full_toy_is_the_mass_damper():
    actions, disturbance = full_actions(), {"ripple_amplitude": 0.4, "lag": 0.3, "gain": 0.7, "state_noise": 0.1}
    full = roll(FULL, actions, ripple_period=0.5, pitch_ripple=0.8, **disturbance)
    plain = roll(MassDamper(), actions[:, :1], ripple_period=0.5, **disturbance)
    for name in ("x", "vx", "drift", "force", "time"):
        np.testing.assert_array_equal(getattr(full, name), getattr(plain, name))


@pytest.mark.parametrize("toy", [MassDamper(), PositionToy()])
def test_the_others_neither_jump_nor_pitch(toy):
    states = roll(toy, random_actions(), ripple_amplitude=0.3, ripple_period=0.5, pitch_ripple=1.0)
    for name in ("z", "vz", "pitch", "pitch_rate", "turn", "torque"):
        assert not getattr(states, name).any()


def test_the_floor_carries():
    """Whatever presses on it: gravity, or a lift that would pull."""
    for lift in (0.0, -1.0, 0.2):  # a fifth of 45 N is less than 9.81 N
        states = roll(FULL, [[0.3, lift, 0.5]] * 20)
        assert not states.z.any()
        assert not states.vz.any()


def test_a_jump_by_hand():
    # off the floor: vz = 0.1 * (45 - 9.81) = 3.519; then 0.981 m/s less each decision, until the floor stops it
    states = roll(FULL, [[0.0, 1.0, 0.0]] + [[0.0, 0.0, 0.0]] * 9)
    flight = 3.519 - 0.981 * np.arange(7)
    np.testing.assert_allclose(states.vz[:7], flight, rtol=1e-5)
    np.testing.assert_allclose(states.z[:7], 0.1 * flight.cumsum(), rtol=1e-5)
    assert states.z[6] > 0.1
    landing = 0.1 * (flight.sum() + flight[-1] - 0.981)
    assert states.z[7] == pytest.approx(landing, abs=1e-5)
    np.testing.assert_allclose(states.vz[8], -states.z[7] / 0.1, rtol=1e-5)  # only as far as the floor
    assert not states.z[8:].any()
    assert not states.vz[9:].any()


def test_nothing_lifts_in_the_air():
    once, held = (roll(FULL, [[0.0, 1.0, 0.0]] + [[0.0, lift, 0.0]] * 7) for lift in (0.0, 1.0))
    assert held.z.min() > 0
    np.testing.assert_array_equal(once.z, held.z)
    half = roll(FULL, [[0.0, 0.5, 0.0]])
    assert half.vz[0] == pytest.approx(0.1 * (22.5 - 9.81))
    assert roll(FULL, [[0.0, 7.0, 0.0]]).vz[0] == pytest.approx(3.519)  # no more than it has


def test_after_a_landing_it_jumps_as_high_again():
    once = [[0.0, 1.0, 0.0]] + [[0.0, 0.0, 0.0]] * 9
    z = roll(FULL, once * 3).z.reshape(3, 10)
    assert z.max() > 0.5
    np.testing.assert_array_equal(z[1:], z[:1].repeat(2, axis=0))


def test_pitch_by_hand():
    # turn1 = 0.1 * 9 = 0.9, pitch1 = 0.09; turn2 = 0.9 + 0.1 * (9 - 4 * 0.9 - 4 * 0.09) = 1.404
    states = roll(FULL, [[0.0, 0.0, 1.0]] * 2)
    np.testing.assert_allclose(states.turn, [0.9, 1.404], rtol=1e-6)
    np.testing.assert_allclose(states.pitch, [0.09, 0.2304], rtol=1e-6)
    np.testing.assert_array_equal(states.torque, [9.0, 9.0])


@pytest.mark.parametrize("toy", [FULL, FullToy(max_torque=3.0, stiffness=6.0, turn_damping=5.0)])
def test_full_torque_holds_the_largest_pitch(toy):
    assert toy.max_pitch == toy.max_torque / toy.stiffness
    for sign in (1.0, -1.0):
        pitch = roll(toy, [[0.0, 0.0, sign]] * FULL_REST).pitch
        assert pitch[-1] == pytest.approx(sign * toy.max_pitch, abs=1e-3)
        assert (np.diff(sign * pitch) > -1e-6).all()  # it comes from one side


def test_no_torque_takes_it_beyond_from_rest():
    rng = np.random.default_rng(0)
    swings = np.sign(np.sin(np.arange(300) / rng.uniform(0.5, 20, (40, 1))))  # in time with any swing
    noise = rng.uniform(-3, 3, (40, 300))
    for share in (swings, noise):
        state = FULL.initial(jnp.zeros(40), jnp.zeros(40))
        actions = jnp.asarray(share[:, :, None] * [0, 0, 1], jnp.float32)
        advance = eqx.filter_jit(
            lambda state, actions: jax.lax.scan(
                lambda state, action: (FULL.step(state, action, jax.random.key(0)),) * 2, state, actions
            )
        )
        _, states = advance(state, jnp.swapaxes(actions, 0, 1))
        assert 0.5 < np.abs(states.pitch).max() <= FULL.max_pitch + 1e-5


def test_a_spring_rights_it():
    pitch = roll(FULL, [[0.0, 0.0, 0.0]] * FULL_REST, pitch=2.0).pitch
    assert pitch[0] == pytest.approx(2.0 - 0.1 * 0.1 * 4 * 2.0)
    assert np.abs(pitch[-1]) < 1e-3
    held = roll(FULL, [[0.0, 0.0, 2.0 / FULL.max_pitch]] * 20, pitch=2.0).pitch
    np.testing.assert_allclose(held, 2.0, atol=1e-4)


def test_velocities_of_the_full_toy_are_displacements_over_time():
    states = roll(
        FULL, full_actions(), ripple_amplitude=0.5, pitch_ripple=0.9, ripple_period=0.37, ripple_phase=1.0, lag=0.2
    )
    for where, speed in (("x", "vx"), ("z", "vz"), ("pitch", "pitch_rate")):
        displacement = np.diff(getattr(states, where), prepend=0.0)
        assert np.abs(displacement).max() > 0.05
        np.testing.assert_allclose(displacement / DECISION_DT, getattr(states, speed), atol=2e-5)


def test_pitch_ripples_with_the_velocity():
    """One sine, two amplitudes; the ripple in pitch is felt by the spring."""
    actions = np.zeros((30, 3))
    waves = {"ripple_period": 0.5, "ripple_phase": 0.3}
    states = roll(FULL, actions, ripple_amplitude=0.2, pitch_ripple=0.8, **waves)
    wave = np.sin(2 * np.pi * DECISION_DT * np.arange(1, 31) / 0.5 + 0.3)
    np.testing.assert_allclose(states.vx - states.drift, 0.2 * wave, atol=1e-4)
    np.testing.assert_allclose(states.pitch_rate - states.turn, 0.8 * wave, atol=1e-4)
    calm = roll(FULL, actions, ripple_amplitude=0.2, **waves)
    np.testing.assert_array_equal(calm.vx, states.vx)
    assert not calm.pitch.any()


def test_lag_and_gain_are_those_of_the_torque_too():
    states = roll(FULL, [[1.0, 0.0, 1.0]] * 3, lag=0.3, gain=0.5)
    arrived = 0.5 * (1 - 0.75 ** np.arange(1, 4))
    np.testing.assert_allclose(states.force, 7 * arrived, rtol=1e-5)
    np.testing.assert_allclose(states.torque, 9 * arrived, rtol=1e-5)


def test_what_is_seen_of_the_full_toy():
    state = FULL.initial(jnp.zeros(4), jnp.zeros(4))
    for key in jax.random.split(jax.random.key(0), 3):
        state = step(FULL, state, jnp.asarray([[1.0, 1.0, 1.0]] * 4), key)
    seen = FULL.observe(state)
    held = {"y", "vy", "roll", "roll_rate", "yaw", "yaw_rate"}
    for name in set(GLOBAL_FIELDS) - held:
        np.testing.assert_array_equal(getattr(seen, name), getattr(state, name))
        assert np.abs(getattr(seen, name)).min() > 0
    assert not any(np.asarray(getattr(seen, name)).any() for name in held)


def test_the_full_toy_goes_on_from_where_any_body_is():
    """A nominal toy that is taken up in mid-flight does what it would have done."""
    actions = full_actions(20)
    actions[:, 1] = 1.0
    states = roll(FULL, actions)
    middle = jax.tree.map(lambda leaf: jnp.asarray(leaf[11]), states)
    again = FULL.from_global(FULL.observe(middle))
    assert middle.z > 0.1
    for i in range(12, 20):
        again = step(FULL, again, jnp.asarray(actions[i], jnp.float32), jax.random.key(0))
    for name in GLOBAL_FIELDS:
        np.testing.assert_allclose(
            getattr(FULL.observe(again), name), getattr(FULL.observe(states), name)[-1], atol=1e-5
        )


def test_a_pitch_to_start_with():
    state = FULL.initial(jnp.zeros(3), jnp.ones(3), pitch=jnp.asarray([-1.0, 0.0, 2.0]))
    np.testing.assert_array_equal(state.pitch, [-1.0, 0.0, 2.0])
    assert not np.asarray(state.pitch_rate).any()
    assert not np.asarray(state.turn).any()
    np.testing.assert_array_equal(FULL.initial(jnp.zeros(3), jnp.zeros(3), pitch=0.5).pitch, [0.5] * 3)


def test_from_global_takes_the_place_of_any_body():
    state = MassDamper().initial(jnp.asarray([2.0]), jnp.asarray([-1.0]))
    again = MassDamper().from_global(MassDamper().observe(state))
    np.testing.assert_array_equal(again.x, [2.0])
    np.testing.assert_array_equal(again.drift, [-1.0])


@pytest.mark.parametrize(
    ("toy", "described"),
    [
        (MassDamper(), {"kind": "mass-damper", "mass": 1.0, "damping": 2.0, "max_force": 7.0}),
        (MassDamper(mass=2.0), {"kind": "mass-damper", "mass": 2.0, "damping": 2.0, "max_force": 7.0}),
        (PositionToy(0.3), {"kind": "position", "max_step": 0.3}),
        (
            FullToy(max_torque=3.0),
            {
                "kind": "full",
                "mass": 1.0,
                "damping": 2.0,
                "max_force": 7.0,
                "gravity": 9.81,
                "max_lift": 45.0,
                "inertia": 1.0,
                "stiffness": 4.0,
                "turn_damping": 4.0,
                "max_torque": 3.0,
            },
        ),
    ],
)
def test_a_toy_is_made_again_from_its_description(toy, described):
    assert describe_toy(toy) == described
    assert make_toy(**described) == toy


def test_toys_have_names():
    assert make_toy("position") == PositionToy()
    with pytest.raises(RebodyError, match=r"unknown toy 'spring'\. Toys are: mass-damper, position, full"):
        make_toy("spring")
