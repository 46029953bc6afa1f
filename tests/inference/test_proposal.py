"""Which quantity, target and law would explain rewards: found again where they were made by one."""

import numpy as np
import pytest

from rebody.inference.proposal import LIBRARY, propose
from rebody.types import POSE_FIELDS, RATE_FIELDS, GlobalState, global_state

TIME = 0.1 * np.arange(150)


@pytest.fixture(scope="module")
def states():
    """A body that moves in every way at once, each by slow waves of its own; the heading goes round."""
    chance, pose = np.random.default_rng(0), {}
    for field in POSE_FIELDS:
        size, speed, phase = chance.uniform([[0.2], [0.2], [0.0]], [[0.8], [2.0], [6.0]], (3, 3))
        pose[field] = (size * [2.0, 1.0, 0.5] * np.sin(np.outer(TIME, speed) + phase)).sum(axis=1)
    pose["z"], pose["yaw"] = 0.5 + 0.15 * pose["z"], 2 * pose["yaw"] + 2.5
    moved = {rate: np.gradient(pose[field], 0.1) for field, rate in zip(POSE_FIELDS, RATE_FIELDS, strict=True)}
    return GlobalState(**(pose | moved | {"yaw": turned(pose["yaw"])}))


def turned(angle):
    return np.angle(np.exp(1j * angle))


@pytest.mark.parametrize(
    ("pay", "name", "target", "kind", "scale", "offset"),
    [
        (lambda s: 1 - 2 * (s.z - 0.8) ** 2, "z", (0.8,), "squared", 2.0, 1.0),
        (lambda s: -3 * abs(s.yaw_rate - 0.5), "yaw_rate", (0.5,), "distance", 3.0, 0.0),
        (lambda s: 3 * np.exp(-((s.x - 0.4) ** 2)) + 1, "x", (0.4,), "gaussian", 3.0, 1.0),
        (lambda s: -abs(turned(s.yaw - 3.0)), "yaw", (3.0,), "distance", 1.0, 0.0),
        (lambda s: -np.hypot(s.x - 2, s.y + 1), "position_xy", (2.0, -1.0), "distance", 1.0, 0.0),
        (lambda s: -abs(s.vx - 0.5) - abs(s.vy), "velocity_xy", (0.5, 0.0), "l1", 1.0, 0.0),
    ],
)
def test_what_paid_is_proposed_first(pay, name, target, kind, scale, offset, states):
    best, second, *_ = propose(states, pay(states))
    assert (best.quantity.name, best.kind) == (name, kind)
    assert best.target == pytest.approx(target, abs=0.02)
    assert (best.scale, best.offset) == (pytest.approx(scale, rel=0.03), pytest.approx(offset, abs=0.05))
    assert best.explained > 0.99 > second.explained
    assert best.cost < second.cost


def test_it_reads_as_a_sentence_and_is_the_same_again(states):
    rewards = 1 - 2 * (states.z - 0.8) ** 2
    first, again = propose(states, rewards), propose(states, rewards)
    assert str(first[0]) == "height (z), target 0.80 m, squared distance times 2, plus 1; explains 100.0 %"
    assert first == again


def test_late_noisy_rewards_with_gaps_are_understood(states):
    chance = np.random.default_rng(1)
    late = np.concatenate([states.z[:1], states.z[:1], states.z[:-2]])
    rewards = -abs(late - 0.6) + 0.005 * chance.normal(size=len(TIME))
    rewards[chance.random(len(TIME)) < 0.3] = np.nan
    best = propose(states, rewards)[0]
    assert (best.quantity.name, best.kind) == ("z", "distance")
    assert best.target == (pytest.approx(0.6, abs=0.02),)
    assert best.explained > 0.95


def test_noise_is_explained_by_nothing(states):
    chance = np.random.default_rng(2)
    for count in (30, len(TIME)):
        few = GlobalState(**{field: values[:count] for field, values in vars(states).items()})
        assert max(each.explained for each in propose(few, chance.normal(size=count))) < 0.5


def test_without_anything_to_explain_or_to_explain_it_by_there_is_no_proposal(states):
    assert propose(states, np.full(len(TIME), 3.0)) == []
    assert propose(states, np.where(np.arange(len(TIME)) < 9, TIME, np.nan)) == []
    assert propose(global_state(x=np.zeros(len(TIME))), TIME) == []
    assert {each.quantity.name for each in propose(global_state(x=TIME), -abs(TIME - 3))} == {"x"}


def test_every_field_has_a_name_once():
    assert len({quantity.components for quantity in LIBRARY}) == len(LIBRARY) == 14
