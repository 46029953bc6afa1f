"""A robot that walks already is a body like any other, its action the joystick."""

import pickle

import numpy as np
import pytest
from tests.walking import CART_TOML, write_cart

from rebody.bodies import RobotBatch, load_robot, simulate
from rebody.bodies.walking.batch import WalkingBatch
from rebody.bodies.walking.measure import measure_walking
from rebody.errors import RebodyError


def run(batch, actions, steps=100):
    for _ in range(steps):
        batch.step(actions)
    return batch


def test_a_cart_goes_where_the_stick_says(cart):
    batch = simulate(cart, 4)
    assert isinstance(batch, WalkingBatch)
    assert (batch.actions, cart.actions, cart.tracker_inputs) == (3, 3, 16)
    batch.reset(np.random.default_rng(0))
    run(batch, np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 0, 1.0], [0, 1.0, 0]]), 100)
    x, y, *_, yaw = batch.pose().T
    np.testing.assert_allclose(x, [2.0, -1.6, 0.0, 0.0], atol=0.2)  # it starts from rest
    assert np.abs(y).max() < 0.05
    assert yaw[2] == pytest.approx(2.5, abs=0.3)  # its wheels scrub: it turns at 83 % of what it is told
    seen = batch.proprioception()
    np.testing.assert_allclose(seen[:3, [0, 0, 2]].diagonal(), [1.0, -0.8, 1.25], atol=0.1)


def test_a_control_cost_counts_what_the_policy_says(cart):
    batch = simulate(cart, 2)
    batch.reset(np.random.default_rng(0))
    run(batch, np.array([[0.0, 0, 0], [1.0, 0, 0]]), 20)
    assert batch.joint_actions.shape == (2, len(batch.joints.names))
    still, moving = np.abs(batch.joint_actions).max(axis=1)
    assert still < 0.05 < moving


def test_a_state_continues_and_a_reset_forgets(cart):
    first, second = simulate(cart, 2), simulate(cart, 2)
    actions = np.array([[0.5, 0, 0.3], [-0.2, 0, 1.0]])
    first.reset(np.random.default_rng(0))
    run(first, actions, 20)
    second.state = first.state
    np.testing.assert_array_equal(run(first, actions, 20).state, run(second, actions, 20).state)
    fresh = simulate(cart, 2)
    for batch in (first, fresh):
        batch.reset(np.random.default_rng(1))
    np.testing.assert_array_equal(run(first, actions, 20).state, run(fresh, actions, 20).state)


def test_one_robot_is_reset_alone(cart):
    batch = simulate(cart, 2)
    batch.reset(np.random.default_rng(0))
    run(batch, np.full((2, 3), 0.5), 10)
    moved = batch.state[0].copy()
    batch.reset(np.random.default_rng(0), np.array([False, True]))
    np.testing.assert_array_equal(batch.state[0], moved)
    assert batch.pose()[1, 0] == 0


def test_it_is_copied_with_what_it_remembers(cart):
    batch = simulate(cart, 2)
    batch.reset(np.random.default_rng(0))
    run(batch, np.full((2, 3), 0.5), 7)
    other = pickle.loads(pickle.dumps(batch))
    actions = np.full((2, 3), -0.4)
    np.testing.assert_array_equal(run(batch, actions, 5).state, run(other, actions, 5).state)


def test_what_a_cart_makes_of_commands_is_measured(cart):
    measured = measure_walking(cart)
    forward, sideways, turn = measured.ways
    np.testing.assert_allclose(forward.reached, forward.commanded, atol=0.03)
    np.testing.assert_allclose(turn.reached, 0.83 * turn.commanded, atol=0.05)
    assert len(sideways.commanded) == 1
    np.testing.assert_allclose(measured.drift, 0.0, atol=0.01)
    assert measured.falls == 0
    assert measured.lag_s < 0.5
    assert measured.dead == (0.0, 0.0, 0.0)
    assert measured.at_once == 3.0
    assert measured.rate == np.inf


def test_a_slow_stick_is_part_of_the_state(tmp_path):
    toml = CART_TOML.replace("turn = [-1.5, 1.5]", "turn = [-1.5, 1.5]\nrate = 2.0")
    batch = simulate(load_robot(str(write_cart(tmp_path, toml))), 1)
    batch.reset(np.random.default_rng(0))
    begun = batch.state.copy()
    slow = run(batch, np.ones((1, 3)), 5).observe().vx[0]  # 0.1 s, so a fifth of the way ahead
    batch.state = begun
    assert run(batch, np.ones((1, 3)), 5).observe().vx[0] == slow
    assert 0 < slow < 0.3


def test_robots_of_trackers_are_what_they_were():
    assert type(simulate(load_robot("cheetah"), 1)) is RobotBatch


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("forward = [-0.8, 1.0]", "forward = [0.2, 1.0]"), r"joystick: each way must be \[low, high\] around 0"),
        (("turn = [-1.5, 1.5]", "turn = [-inf, 1.5]"), r"joystick: each way must be \[low, high\] around 0"),
        (("turn = [-1.5, 1.5]", "turn = [-1.5, 1.5]\ndead = [-1.0, 0.0, 0.0]"), "joystick.dead must not be negative"),
        (("turn = [-1.5, 1.5]", "turn = [-1.5, 1.5]\nat_once = 0.5"), "joystick.at_once must be from 1 to 3"),
        (("turn = [-1.5, 1.5]", "turn = [-1.5, 1.5]\nrate = 0.0"), "joystick.rate must be positive"),
        (('inputs = ["command"]', 'inputs = ["command"]\nhistory = 0'), "history must be at least 1"),
        (('inputs = ["command"]', 'inputs = ["smell"]'), "Invalid enum value 'smell'"),
        (
            ('onnx = "cart.onnx"', 'onnx = "${REBODY_NO_SUCH_FOLDER}/cart.onnx"'),
            "REBODY_NO_SUCH_FOLDER.*which is not set",
        ),
    ],
)
def test_descriptions_that_cannot_be(tmp_path, change, says):
    assert change[0] in CART_TOML
    with pytest.raises(RebodyError, match=says):
        load_robot(str(write_cart(tmp_path, CART_TOML.replace(*change))))


def test_paths_may_name_environment_variables(tmp_path, monkeypatch):
    folder = tmp_path / "models"
    folder.mkdir()
    write_cart(folder)
    monkeypatch.setenv("CART_FILES", str(folder))
    toml = CART_TOML.replace('"cart.', '"${CART_FILES}/cart.')
    (tmp_path / "cart.toml").write_text(toml)
    spec = load_robot(str(tmp_path / "cart.toml"))
    assert spec.walking.onnx == folder / "cart.onnx"
    assert spec.model.nu == 2
