"""The toys' arithmetic, and that each disturbance does what it says and nothing when it is off."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.bodies.disturbance import CALM, Randomisation, no_disturbance
from rebody.bodies.toys import (
    AXES,
    RATES,
    FullToy,
    MassDamper,
    PlaneToy,
    PositionToy,
    SpaceToy,
    describe_toy,
    make_toy,
)
from rebody.errors import RebodyError
from rebody.types import DECISION_DT, GLOBAL_FIELDS, GlobalState, global_state

FULL, PLANE = FullToy(), PlaneToy()
TOYS = [MassDamper(), PositionToy(), FULL, PLANE, SpaceToy()]
step = eqx.filter_jit(lambda toy, state, action, key: toy.step(state, action, key))


class Course:
    """States of a toy, its axes by name: `x`, `vx`, and `drift_x`, `force_x` of what lies behind."""

    def __init__(self, states):
        self.time = np.asarray(states.time)
        for i, (axis, rate) in enumerate(zip(AXES, RATES, strict=True)):
            for name, along in ((axis, "position"), (rate, "velocity"), (f"drift_{axis}", "drift")):
                setattr(self, name, np.asarray(getattr(states, along))[..., i])
            setattr(self, f"force_{axis}", np.asarray(states.force)[..., i])


def states_of(toy, actions, *, start=None, **disturbance):
    """States after each action of one toy that starts at rest, or where `start` says; its disturbance's fields by name.

    An action is one number for all that a toy's action consists of, or all of them.
    """
    fields = tuple(disturbance)
    values = tuple(jnp.asarray(value, jnp.float32) for value in disturbance.values())
    nominal = no_disturbance(())
    state = toy.begin(
        start or global_state(x=jnp.zeros(())),
        eqx.tree_at(lambda d: tuple(getattr(d, field) for field in fields), nominal, values) if fields else nominal,
    )
    states = []
    for key, action in zip(jax.random.split(jax.random.key(0), len(actions)), actions, strict=True):
        state = step(toy, state, jnp.broadcast_to(jnp.asarray(action, jnp.float32), (toy.actions,)), key)
        states.append(state)
    return jax.tree.map(lambda *leaves: np.stack(leaves), *states)


def roll(toy, actions, *, pitch=0.0, **disturbance):
    """The course of `states_of`, from rest at a pitch."""
    return Course(states_of(toy, actions, start=global_state(pitch=jnp.asarray(pitch, jnp.float32)), **disturbance))


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
    np.testing.assert_array_equal(rippled.drift_x, plain.drift_x)


def test_lag_is_a_first_order_delay_of_the_force():
    # share of the difference made up in each step: dt / (dt + lag) = 1/4
    force = roll(MassDamper(), [1.0] * 3, lag=0.3).force_x
    np.testing.assert_allclose(force, 7 * (1 - 0.75 ** np.arange(1, 4)), rtol=1e-5)


@pytest.mark.parametrize("toy", TOYS)
def test_gain_weakens_the_action(toy):
    actions = random_actions()
    weak, half = roll(toy, actions, gain=0.5), roll(toy, 0.5 * actions)
    np.testing.assert_allclose(weak.x, half.x, atol=1e-5)


@pytest.mark.parametrize("toy", TOYS)
def test_noise_has_its_standard_deviation(toy):
    noisy = eqx.tree_at(lambda d: d.state_noise, no_disturbance((20_000,)), jnp.full(20_000, 0.2))
    states = toy.begin(global_state(x=jnp.zeros(20_000)), noisy)
    after = step(toy, states, jnp.zeros((20_000, toy.actions)), jax.random.key(1))
    has_momentum = isinstance(toy, MassDamper)
    for axis in range(len(AXES)):
        felt = 0.2 if AXES[axis] in toy.axes and AXES[axis] in ("x", "y") else 0.0
        noise = np.asarray(after.position - DECISION_DT * after.velocity)[:, axis]
        assert noise.mean() == pytest.approx(0.0, abs=0.01)
        assert noise.std() == pytest.approx(felt, rel=0.03)
        assert np.asarray(after.drift)[:, axis].std() == pytest.approx(felt if has_momentum else 0.0, rel=0.03)


@pytest.mark.parametrize("toy", TOYS)
def test_a_nominal_toy_does_not_depend_on_the_key(toy):
    state, action = toy.begin(global_state(x=jnp.ones(3), vx=jnp.ones(3))), jnp.ones((3, toy.actions))
    one, other = (step(toy, state, action, jax.random.key(seed)) for seed in (0, 1))
    jax.tree.map(np.testing.assert_array_equal, one, other)
    np.testing.assert_array_equal(one.velocity, one.drift)


def test_randomisation_stays_in_its_ranges():
    drawn = Randomisation(state_noise=0.04).sample(jax.random.key(0), (1000,))
    for values, low, high in [
        (drawn.ripple_amplitude, 0.0, 0.6),
        (drawn.ripple_period, 0.2, 0.8),
        (drawn.pitch_ripple, 0.0, 1.0),
        (drawn.across_ripple, 0.0, 0.3),
        (drawn.yaw_ripple, 0.0, 0.5),
        (drawn.lag, 0.0, 0.5),
        (drawn.gain, 0.5, 1.0),
    ]:
        assert low <= values.min() < low + 0.05 * (high - low)
        assert high >= values.max() > high - 0.05 * (high - low)
    np.testing.assert_allclose(drawn.state_noise, 0.2, rtol=1e-6)
    parts = np.stack(jax.tree.leaves(drawn))
    apart = np.corrcoef(parts[parts.std(axis=1) > 1e-6]) - np.eye(8)
    assert np.abs(apart).max() < 0.15  # each is drawn for itself


@pytest.mark.parametrize("toy", TOYS)
@pytest.mark.parametrize("shape", [(), (3,), (2, 3)])
def test_any_batch_shape(toy, shape):
    state = toy.begin(global_state(x=jnp.zeros(shape)), Randomisation().sample(jax.random.key(0), shape))
    after = step(toy, state, jnp.ones((*shape, toy.actions)), jax.random.key(0))
    observed = toy.observe(after)
    assert isinstance(observed, GlobalState)
    assert all(leaf.shape == shape for leaf in jax.tree.leaves(observed))


FULL_REST = 100  # decisions after which nothing moves any more


def test_one_action_for_each_thing_that_a_toy_can_do():
    assert [toy.actions for toy in TOYS] == [1, 1, 3, 3, 5]
    assert [toy.max_pitch for toy in TOYS] == [0.0, 0.0, 2.25, 0.0, 2.25]
    assert [toy.axes for toy in TOYS] == [("x",), ("x",), ("x", "z", "pitch"), ("x", "y", "yaw"), AXES]


def test_along_x_the_full_toy_is_the_mass_damper():
    actions, disturbance = full_actions(), {"ripple_amplitude": 0.4, "lag": 0.3, "gain": 0.7, "state_noise": 0.1}
    full = roll(FULL, actions, ripple_period=0.5, pitch_ripple=0.8, **disturbance)
    plain = roll(MassDamper(), actions[:, :1], ripple_period=0.5, **disturbance)
    for name in ("x", "vx", "drift_x", "force_x", "time"):
        np.testing.assert_allclose(getattr(full, name), getattr(plain, name), atol=1e-6)


@pytest.mark.parametrize("toy", TOYS)
def test_along_held_axes_nothing_moves(toy):
    rough = dict.fromkeys(("ripple_amplitude", "pitch_ripple", "across_ripple", "yaw_ripple", "state_noise"), 0.7)
    wild = {field: jnp.asarray(1.5) for field in GLOBAL_FIELDS}
    actions = np.random.default_rng(0).uniform(-1, 1, (50, toy.actions))
    states = states_of(toy, actions, start=GlobalState(**wild), ripple_period=0.53, ripple_phase=0.4, **rough)
    for name in ("position", "velocity", "drift", "force"):
        moved = np.abs(getattr(states, name)).max(axis=0) > 0
        expected = toy.moves & (np.array(AXES) != "z") if name == "force" else toy.moves
        np.testing.assert_array_equal(moved, expected & (name != "force" or not isinstance(toy, PositionToy)))


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
    np.testing.assert_allclose(states.drift_pitch, [0.9, 1.404], rtol=1e-6)
    np.testing.assert_allclose(states.pitch, [0.09, 0.2304], rtol=1e-6)
    np.testing.assert_array_equal(states.force_pitch, [9.0, 9.0])


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
        state = FULL.begin(global_state(x=jnp.zeros(40)))
        actions = jnp.asarray(share[:, :, None] * [0, 0, 1], jnp.float32)
        advance = eqx.filter_jit(
            lambda state, actions: jax.lax.scan(
                lambda state, action: (FULL.step(state, action, jax.random.key(0)),) * 2, state, actions
            )
        )
        _, states = advance(state, jnp.swapaxes(actions, 0, 1))
        assert 0.5 < np.abs(Course(states).pitch).max() <= FULL.max_pitch + 1e-5


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
    np.testing.assert_allclose(states.vx - states.drift_x, 0.2 * wave, atol=1e-4)
    np.testing.assert_allclose(states.pitch_rate - states.drift_pitch, 0.8 * wave, atol=1e-4)
    calm = roll(FULL, actions, ripple_amplitude=0.2, **waves)
    np.testing.assert_array_equal(calm.vx, states.vx)
    assert not calm.pitch.any()


def test_lag_and_gain_are_those_of_the_torque_too():
    states = roll(FULL, [[1.0, 0.0, 1.0]] * 3, lag=0.3, gain=0.5)
    arrived = 0.5 * (1 - 0.75 ** np.arange(1, 4))
    np.testing.assert_allclose(states.force_x, 7 * arrived, rtol=1e-5)
    np.testing.assert_allclose(states.force_pitch, 9 * arrived, rtol=1e-5)


@pytest.mark.parametrize("toy", TOYS)
def test_what_is_seen_of_a_toy(toy):
    state = toy.begin(global_state(x=jnp.zeros(4)))
    for key in jax.random.split(jax.random.key(0), 3):
        state = step(toy, state, jnp.ones((4, toy.actions)), key)
    seen, course = toy.observe(state), Course(state)
    for axis, rate in zip(AXES, RATES, strict=True):
        for name in (axis, rate):
            np.testing.assert_allclose(getattr(seen, name), getattr(course, name), atol=1e-6)
            assert bool(np.abs(getattr(seen, name)).min() > 0) == (axis in toy.axes)
    assert not np.asarray(seen.roll).any()
    assert not np.asarray(seen.roll_rate).any()


@pytest.mark.parametrize("toy", TOYS)
def test_a_toy_goes_on_from_where_any_body_is(toy):
    """A nominal toy that is taken up in mid-flight does what it would have done."""
    actions = np.random.default_rng(0).uniform(-1, 1, (20, toy.actions))
    if "z" in toy.axes:
        actions[:, toy.axes.index("z")] = 1.0
    states = states_of(toy, actions)
    again = toy.begin(toy.observe(jax.tree.map(lambda leaf: jnp.asarray(leaf[11]), states)))
    for i in range(12, 20):
        again = step(toy, again, jnp.asarray(actions[i], jnp.float32), jax.random.key(0))
    last = toy.observe(jax.tree.map(lambda leaf: jnp.asarray(leaf[-1]), states))
    for name in GLOBAL_FIELDS:
        np.testing.assert_allclose(getattr(toy.observe(again), name), getattr(last, name), atol=1e-5)


def test_the_plane_is_two_lines():
    """Forces along x and y do not know each other; a torque turns by up to 9 / 4 rad/s."""
    actions = np.random.default_rng(0).uniform(-1, 1, (50, 3))
    states = roll(PLANE, actions)
    for axis, i in (("x", 0), ("y", 1)):
        np.testing.assert_allclose(getattr(states, axis), roll(MassDamper(), actions[:, i : i + 1]).x, atol=1e-5)
    assert roll(PLANE, [[0.0, 0.0, 1.0]] * 60).yaw_rate[-1] == pytest.approx(2.25, abs=1e-4)


def test_a_heading_wraps_where_it_is_seen():
    states = states_of(PLANE, [[0.0, 0.0, 1.0]] * 40)
    yaw = np.asarray(PLANE.observe(jax.tree.map(jnp.asarray, states)).yaw)
    assert states.position[-1, 4] > 2 * np.pi
    assert np.abs(yaw).max() <= np.pi
    np.testing.assert_allclose(np.cos(yaw), np.cos(states.position[:, 4]), atol=1e-5)


def test_a_gait_is_in_the_frame_of_the_heading():
    """It ripples along the heading at every step, sways across it and in it at every second one."""
    waves = {"ripple_period": 0.5, "ripple_phase": 0.3}
    phase = 2 * np.pi * DECISION_DT * np.arange(1, 31) / 0.5 + 0.3
    for yaw, along, across in ((0.0, "x", "y"), (np.pi / 2, "y", "x")):
        start = global_state(yaw=jnp.asarray(yaw))
        states = Course(
            states_of(PLANE, np.zeros((30, 3)), start=start, ripple_amplitude=0.4, across_ripple=0.2, **waves)
        )
        rates = dict(zip(AXES, RATES, strict=True))
        sign = 1.0 if across == "y" else -1.0
        np.testing.assert_allclose(getattr(states, rates[along]), 0.4 * np.sin(phase), atol=1e-4)
        np.testing.assert_allclose(getattr(states, rates[across]), sign * 0.2 * np.sin(phase / 2), atol=1e-4)
    swaying = roll(PLANE, np.zeros((30, 3)), yaw_ripple=0.6, **waves)
    np.testing.assert_allclose(swaying.yaw_rate, 0.6 * np.sin(phase / 2), atol=1e-4)
    assert not swaying.x.any()


def test_one_that_turns_first_runs_where_it_faces():
    toy = PlaneToy(turns_first=True)
    start = global_state(yaw=jnp.asarray(np.pi / 2))
    sideways, ahead = (
        Course(states_of(toy, [action] * 10, start=start)) for action in ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    )
    np.testing.assert_allclose([sideways.x, sideways.y], 0.0, atol=1e-5)
    np.testing.assert_allclose(ahead.y, roll(PLANE, [[0.0, 1.0, 0.0]] * 10).y, atol=1e-5)
    oblique = Course(states_of(toy, [[0.8, 0.4, 0.0]], start=global_state(yaw=jnp.asarray(0.5))))
    share = 0.8 * np.cos(0.5) + 0.4 * np.sin(0.5)
    np.testing.assert_allclose([oblique.vx[0], oblique.vy[0]], 0.7 * share * np.array([np.cos(0.5), np.sin(0.5)]), 1e-5)


@pytest.mark.parametrize("toy", TOYS)
def test_nothing_disturbs_where_it_is_calm(toy):
    actions = np.random.default_rng(0).uniform(-1, 1, (20, toy.actions))
    calm = jax.tree.map(lambda leaf: leaf[0], CALM.sample(jax.random.key(0), (1,)))
    state = toy.begin(global_state(x=jnp.zeros(())), calm)
    for action in actions:
        state = step(toy, state, jnp.asarray(action, jnp.float32), jax.random.key(1))
    np.testing.assert_array_equal(state.position, states_of(toy, actions).position[-1])


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
                "held": ("y", "yaw"),
                "turns_first": False,
            },
        ),
    ],
)
def test_a_toy_is_made_again_from_its_description(toy, described):
    assert describe_toy(toy) == described
    assert make_toy(**described) == toy


def test_toys_have_names():
    assert make_toy("position") == PositionToy()
    with pytest.raises(
        RebodyError, match=r"unknown toy 'spring'\. Toys are: mass-damper, position, full, plane, space"
    ):
        make_toy("spring")
