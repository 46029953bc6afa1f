"""Under stress: subgoals that change at random, and pushes."""

import jax
import numpy as np
import pytest

from rebody.agents.rollout import follow
from rebody.bodies import RobotBatch, load_robot
from rebody.cli.main import run
from rebody.control.command import commands_within
from rebody.control.sac import Actor, SACConfig
from rebody.control.tracker import Tracker, command_inputs
from rebody.evaluation import stress as module
from rebody.evaluation.stress import Countdown, stress
from rebody.tasks import SHIPPED


@pytest.fixture(autouse=True)
def in_short(monkeypatch):
    monkeypatch.setattr(module, "SECONDS", 2.0)
    monkeypatch.setattr(module, "PUSH_S", (0.5, 1.0))


def untrained(spec):
    """A tracker that hardly acts."""
    families = commands_within(spec.reach, SHIPPED)
    size = spec.tracker_inputs + command_inputs(families)
    return Tracker(Actor(size, spec.model.nu, SACConfig(hidden=(4,)), jax.random.key(0)), families)


def test_a_hopper_that_does_nothing_falls_and_a_cheetah_does_not():
    hopper, cheetah = load_robot("hopper"), load_robot("cheetah")
    assert stress(untrained(hopper), hopper, 4).fell.all()
    assert not stress(untrained(cheetah), cheetah, 4).fell.any()


def test_pushes_and_subgoals_hang_on_the_seed_alone(monkeypatch):
    spec = load_robot("cheetah")
    pushed = []
    monkeypatch.setattr(RobotBatch, "push", lambda batch, change: pushed.append(change.copy()))
    for seed in (0, 0, 1):
        stress(untrained(spec), spec, 4, seed)
    first, again, other = np.split(np.array(pushed), 3)
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()
    assert set(np.unique(first)) == {-0.3, 0.0, 0.3}
    assert (np.abs(first).sum(axis=0) / 0.3 >= 1).all()  # each in two seconds


def test_a_clock_strikes_within_its_range():
    clock = Countdown(np.random.default_rng(0), (0.5, 1.0), 0.05, 200)
    struck = np.array([clock.due() for _ in range(400)])
    between = np.concatenate([np.diff(np.flatnonzero(of_robot)) for of_robot in struck.T])
    assert (between.min(), between.max()) == (10, 20)
    assert 10 <= np.argmax(struck, axis=0).min() <= np.argmax(struck, axis=0).max() <= 20


@pytest.fixture
def told(monkeypatch):
    """(where each robot is, slot, value) at every control step of what is stressed."""
    told = []

    def spy(controller, batch, subgoal):
        told.append((batch.qpos[:, 0].copy(), subgoal.slot, subgoal.value[:, 0]))
        follow(controller, batch, subgoal)

    monkeypatch.setattr(module, "follow", spy)
    return told


def test_subgoals_lie_within_reach_and_change_as_often_as_they_should(told):
    spec = load_robot("cheetah")
    stress(untrained(spec), spec, 30)
    x, slot, value = (np.array(of_step) for of_step in zip(*told, strict=True))
    families = commands_within(spec.reach, SHIPPED)
    assert set(np.unique(slot)) == set(range(len(families))) == {0, 1, 2}
    is_new = np.concatenate([np.ones((1, 30), bool), np.diff(value, axis=0) != 0])
    between = np.concatenate([np.diff(np.flatnonzero(of_robot)) for of_robot in is_new.T])
    assert between.min() >= 20  # 1 s
    assert is_new[1:].any(axis=0).mean() > 0.1
    asked = np.where(slot == families.index("goal"), value - x, value)[is_new]
    ends = np.array([(*family.range.low, *family.range.high) for family in families])
    low, high = ends[slot[is_new]].T
    assert ((asked >= low - 1e-5) & (asked <= high + 1e-5)).all()
    assert (np.abs(asked) > 0.5 * high).any()


def test_the_same_seed_ends_the_same(told):
    """Hoppers that fall at different times."""
    spec = load_robot("hopper")
    for seed in (3, 3, 4):
        stress(untrained(spec), spec, 3, seed)
    first, again, other = (np.array([x for x, _, _ in run]) for run in np.array_split(np.array(told, object), 3))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


def test_the_command(trained, capsys):
    flags = ["--robot", "cheetah", "--tracker", str(trained["tracker"]), "--episodes", "3"]
    assert run(["stress", *flags]) == 0
    assert "fallen in 0 of 3 episodes" in capsys.readouterr().out
    assert run(["stress", "--robot", "hopper", *flags[2:]]) == 2
    assert "was trained on 'cheetah', not on 'hopper'" in capsys.readouterr().err
    assert run(["stress", *flags[:-1], "0"]) == 2
    assert "--episodes must be at least 1" in capsys.readouterr().err
