"""A walking policy from its first step to the robot that walks by it."""

import signal
from dataclasses import replace

import jax
import numpy as np
import pytest

from rebody.bodies import load_robot, simulate
from rebody.bodies.walking.batch import joint_interface
from rebody.bodies.walking.trained import TrainedPolicy
from rebody.cli.main import run
from rebody.control.sac import Actor, SACConfig
from rebody.errors import RebodyError
from rebody.training.off_policy import initial_state
from rebody.training.run import Interrupted
from rebody.training.walking import WalkingConfig, train, train_walking
from rebody.training.walking.commands import CommandDistribution
from rebody.training.walking.follower import ActorFollower
from rebody.training.walking.relabelling import Relabelling, command_columns
from rebody.training.walking.reward import walking_reward
from rebody.training.walking.scales import input_scales, loaded_actor


def collected(cart, config, turns=1):
    """The learner, its robots, and the state after some turns."""
    learner = train.WalkingLearner(cart, config)
    batch = learner.simulate(config.robots)
    batch.reset(np.random.default_rng(0))
    state = initial_state(learner, batch, jax.random.key(0))
    for i in range(turns):
        learner.collect(state, batch, np.random.default_rng(i), jax.random.key(i))
    return learner, batch, state


def test_rows_of_the_buffer_belong_together(cart, config):
    config = replace(config, push=0.0, commands=CommandDistribution(zero_share=0.0))
    learner, batch, state = collected(cart, config, 2)
    rows, size = state.replay.rows, 2 * config.steps * config.robots
    columns = command_columns(batch.joints)
    felt = np.setdiff1d(np.arange(learner.sizes(batch)[0]), columns)
    after = slice(config.robots, size)
    np.testing.assert_array_equal(rows.next_seen[: size - config.robots, felt], rows.seen[after][:, felt])
    np.testing.assert_array_equal(rows.seen[:size, columns], rows.command[:size])
    np.testing.assert_array_equal(rows.action[: size - config.robots], rows.last_action[after])
    assert np.abs(rows.stride.speed[:size, 0]).max() > 0.05


def test_half_of_a_batch_learns_under_its_own_command(cart, config):
    learner, batch, state = collected(cart, config, 2)
    rows = jax.tree.map(lambda leaf: leaf[:40], state.replay.rows)
    columns, scales = command_columns(batch.joints), input_scales(batch.joints)
    told = Relabelling(config, learner.limits, scales, columns, None)(rows, jax.random.key(0))
    command = np.asarray(told.observation)[:, columns]
    np.testing.assert_allclose(command[20:], rows.command[20:], rtol=1e-6)
    assert np.abs(command[:20] - rows.command[:20]).max() > 0.1
    np.testing.assert_array_equal(command, np.asarray(told.next_observation)[:, columns])
    rest = np.setdiff1d(np.arange(len(scales)), columns)
    np.testing.assert_allclose(np.asarray(told.observation)[:, rest], (rows.seen * scales)[:, rest], rtol=1e-6)
    reward = walking_reward(command, rows.stride, rows.action, rows.last_action, config.reward)
    np.testing.assert_allclose(told.reward, reward, rtol=1e-5)


def test_an_artifact_acts_as_the_actor_that_it_was_made_of(cart_path, cart, config):
    folder = train_walking(str(cart_path), config, cart_path.parent / "learned", seed=0)
    actor = loaded_actor(str(folder), joint_interface(cart), config.sac)
    walks = load_robot(str(cart_path))
    ours, shipped = ActorFollower(walks, 3, actor), simulate(walks, 3)
    command = np.array([[0.5, 0.0, 0.0], [-0.2, 0.0, 1.0], [0.0, 0.0, 0.0]])
    for batch in (ours, shipped):
        batch.reset(np.random.default_rng(0))
        for _ in range(20):
            batch.follow(command)
    np.testing.assert_allclose(ours.qpos, shipped.qpos, atol=1e-4)
    assert walks.walking.joystick.drift == TrainedPolicy(str(folder)).settings.drift
    card = (folder / "card.md").read_text()
    for part in ("# Walking policy: cart", "48 control steps with 10 updates", "forward in [-0.8, 1]", "slow commands"):
        assert part in card


def test_a_resumed_run_ends_as_the_uninterrupted_one(cart_path, config, after_turn):
    whole = train_walking(str(cart_path), config, cart_path.parent / "whole", seed=1)
    after_turn(1, lambda: signal.raise_signal(signal.SIGINT))
    begun = cart_path.parent / "begun"
    with pytest.raises(Interrupted):
        train_walking(str(cart_path), config, begun, seed=1)
    train_walking(str(cart_path), config, begun, seed=1, resume=True)
    one, other = ((folder / "weights.safetensors").read_bytes() for folder in (whole, begun))
    assert one == other


def test_a_cart_learns_what_its_joystick_means(cart_path, cart):
    config = WalkingConfig(
        robots=16,
        steps=16,
        updates=64,
        iterations=20,
        replay=10_000,
        held_out=50,
        final_held_out=3,
        final_s=2.2,
        sac=SACConfig(hidden=(32, 32), batch_size=64, learning_rate=3e-3, discount=0.5, decay_updates=1280),
    )
    learner = train.WalkingLearner(cart, config)
    untrained = learner.measure(Actor(9, 2, config.sac, jax.random.key(0)))
    folder = train_walking(str(cart_path), config, cart_path.parent / "learned", seed=0)
    learned = learner.measure(loaded_actor(str(folder), joint_interface(cart), config.sac))
    for way in ("forward", "turn"):
        assert learned[f"{way} median"] < 0.4 * untrained[f"{way} median"]


def test_what_cannot_be_trained(cart_path, config, tmp_path):
    with pytest.raises(RebodyError, match="'cheetah' follows no joystick"):
        train_walking("cheetah", config, tmp_path / "run", seed=0)
    deaf = cart_path.with_name("deaf.toml")
    deaf.write_text(cart_path.read_text().replace('"command"]', '"command", "height"]'))
    with pytest.raises(RebodyError, match="does not hear height"):
        train_walking(str(deaf), config, tmp_path / "run", seed=0)
    folder = train_walking(str(cart_path), config, cart_path.parent / "learned", seed=0)
    wider = replace(config, sac=replace(config.sac, hidden=(8, 9)))
    with pytest.raises(RebodyError, match=r"cannot start from .*other layers"):
        train_walking(str(cart_path), wider, tmp_path / "other", seed=0, init_from=str(folder))


def test_a_robot_without_its_policy_says_how_to_get_one(cart_path, capsys):
    with pytest.raises(RebodyError, match=r"unknown|not a complete artifact|missing"):
        simulate(load_robot(str(cart_path)), 1)
    assert run(["robot", "check", str(cart_path)]) == 0
    assert f"ready: rebody train tracker {cart_path}" in capsys.readouterr().out.replace("\n", "")
