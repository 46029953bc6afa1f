"""A copy goes on as the environment that it was made of would, and neither notices the other."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence

from rebody.envs import BeliefObservation

COPIES = [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))]
COPIES_IDS = ["deepcopy", "pickle"]


def make(name):
    return gymnasium.make(name, max_episode_steps=12)


def believing():
    return BeliefObservation(make("rebody/HalfCheetah-v0"), "position", control_dt=0.05)


def many(name):
    return gymnasium.make_vec(name, 3, vectorization_mode="vector_entry_point", max_episode_steps=12)


MADE = {
    "point mass": lambda: make("rebody/PointMass-v0"),
    "cheetah": lambda: make("rebody/HalfCheetah-v0"),
    "hopper": lambda: make("rebody/Hopper-v0"),  # its tracker's pace goes along
    "tracker": lambda: make("rebody/HopperTracker-v0"),
    "belief": believing,
    "point masses": lambda: many("rebody/PointMass-v0"),
    "cheetahs": lambda: many("rebody/HalfCheetah-v0"),
}


def run(env, actions):
    """What comes of these actions, and of a reset by the same generator."""
    return [env.step(action) for action in actions] + [env.reset()]


@pytest.mark.parametrize("copied", COPIES, ids=COPIES_IDS)
@pytest.mark.parametrize("of", MADE)
def test_a_copy_goes_on_exactly_and_alone(of, copied):
    env = MADE[of]()
    env.action_space.seed(0)
    env.reset(seed=5)
    actions = [env.action_space.sample() for _ in range(14)]
    for action in actions[:5]:
        env.step(action)
    twin, third = copied(env), copied(env)
    ahead = run(twin, actions[5:12])
    run(third, [-action for action in actions[5:12]])
    assert data_equivalence(run(env, actions[5:12]), ahead, exact=True)
    assert data_equivalence(run(env, actions[12:]), run(twin, actions[12:]), exact=True)


@pytest.mark.parametrize("copied", COPIES, ids=COPIES_IDS)
@pytest.mark.parametrize("of", ["cheetah", "cheetahs", "tracker"])
def test_a_copy_before_the_first_reset(of, copied):
    env = MADE[of]()
    twin = copied(env)
    assert data_equivalence(env.reset(seed=2), twin.reset(seed=2), exact=True)


@pytest.mark.parametrize("copied", COPIES, ids=COPIES_IDS)
def test_a_copy_has_a_camera_of_its_own(copied):
    env = gymnasium.make("rebody/HalfCheetah-v0", render_mode="rgb_array")
    env.reset(seed=0)
    first, picture = env.render(), env.render()  # a camera's first picture is not quite like its later ones
    twin = copied(env)
    np.testing.assert_array_equal(twin.render(), first)
    twin.close()
    np.testing.assert_array_equal(env.render(), picture)
    env.close()
