"""Seeds and options of resets: Gymnasium's conventions, and clear errors after which nothing has changed."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence

from rebody.errors import RebodyError

IDS = ["rebody/PointMass-v0", "rebody/HalfCheetah-v0"]
TRACKER = "rebody/HalfCheetahTracker-v0"
SEED = r"a seed must be a whole number of at least 0 and less than 2\^128, not "
BAD_SEEDS = [-1, "a", 1.5, True, 2**128, np.float64(3.0), {1}]


def vector(name, mode="vector_entry_point", **settings):
    return gymnasium.make_vec(name, 3, vectorization_mode=mode, max_episode_steps=4, **settings)


def test_seeds_are_those_of_gymnasium():
    env = gymnasium.make(IDS[1])
    first, info = env.reset(seed=7)
    again, told = env.reset(seed=np.int64(7))
    assert data_equivalence((first, info), (again, told), exact=True)
    assert env.unwrapped.np_random_seed == 7
    env.unwrapped.reset(seed=gymnasium.make(IDS[0]).unwrapped.np_random_seed)  # drawn: 128 bits


@pytest.mark.parametrize("name", [*IDS, TRACKER])
@pytest.mark.parametrize("seed", [*BAD_SEEDS, [1]])
def test_a_seed_that_is_none_is_refused_and_nothing_is_reset(name, seed):
    env = gymnasium.make(name).unwrapped
    env.reset(seed=3)
    generator, expected = env.np_random.bit_generator.state, env.step(np.zeros(env.action_space.shape))[0]
    env.reset(seed=3)
    with pytest.raises(RebodyError, match=SEED):
        env.reset(seed=seed)
    assert (env.np_random_seed, env.np_random.bit_generator.state) == (3, generator)
    np.testing.assert_array_equal(env.step(np.zeros(env.action_space.shape))[0], expected)


@pytest.mark.parametrize("options", [3, "goal", ["goal", 1.0], np.ones(2), {"gaol": 1}])
def test_options_that_are_none_are_refused_and_nothing_is_reset(options):
    for env in (gymnasium.make(IDS[0]).unwrapped, gymnasium.make(TRACKER).unwrapped, vector(IDS[0])):
        env.reset(seed=3)
        before = str(env.np_random)
        with pytest.raises(RebodyError, match="reset options are"):
            env.reset(seed=4, options=options)
        assert str(env.np_random) == before
        assert np.ravel(env.np_random_seed)[0] == 3


@pytest.mark.parametrize("name", [*IDS, TRACKER])
def test_no_options_are_none(name):
    env = gymnasium.make(name)
    assert data_equivalence(env.reset(seed=1, options={}), env.reset(seed=1), exact=True)


@pytest.mark.parametrize(
    ("seed", "message"),
    [
        ([1, 2], "there are 2 seeds for 3 bodies; give one for each, or one integer"),
        ((), "there are 0 seeds for 3 bodies"),
        (np.arange(4), "there are 4 seeds for 3 bodies"),
        (2**128 - 2, SEED + str(2**128)),
        *[(seed, SEED) for seed in BAD_SEEDS],
        *[([1, seed, 2], SEED) for seed in BAD_SEEDS],
        ([[1], [2], [3]], SEED),
        (np.ones((3, 2), int), SEED),
        (np.ones(3), SEED),
        ("abc", SEED + "'abc'"),
    ],
)
def test_vector_seeds_that_are_none_are_refused_and_nothing_is_reset(seed, message):
    envs = vector(IDS[0])
    envs.reset(seed=5)
    observation, *_, before = envs.step(np.ones((3, 1)))
    with pytest.raises(RebodyError, match=message):
        envs.reset(seed=seed)
    assert envs.np_random_seed == (5, 6, 7)
    np.testing.assert_array_equal(envs._world.observations(), observation)
    assert data_equivalence(envs._info(np.ones(3, bool)), before, exact=True)


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize("seed", [4, [9, 2, 30], (9, None, 30), [None, None, 1], np.array([3, 1, 2])])
def test_a_seed_of_each_body_as_gymnasium_takes_it(name, seed):
    ours, theirs = vector(name), vector(name, "sync")
    told = seed.tolist() if isinstance(seed, np.ndarray) else seed
    for envs in (ours, theirs):
        envs.reset(seed=0)
    assert data_equivalence(ours.reset(seed=seed), theirs.reset(seed=told))
    assert ours.np_random_seed == theirs.np_random_seed
    assert data_equivalence(ours.reset(), theirs.reset())


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize("task", [{}, {"family": "velocity", "target": -2.0}])
def test_a_mask_chooses_who_is_reset(name, task):
    """In mid-episode, and where an episode has just ended; over the next automatic resets."""
    ours, theirs = vector(name), vector(name, "sync")
    ours.action_space.seed(0)
    for envs in (ours, theirs):
        envs.reset(seed=11)
    for chosen, seed in (([True, False, False], 3), ([False, True, True], [None, 8, None]), ([True] * 3, None)):
        mask = np.array(chosen)
        options = {"reset_mask": mask} | task
        assert data_equivalence(ours.reset(seed=seed, options=options), theirs.reset(seed=seed, options=dict(options)))
        assert options["reset_mask"] is mask
        for _ in range(6):
            actions = ours.action_space.sample()
            assert data_equivalence(ours.step(actions), theirs.step(actions))
    for envs in (ours, theirs):  # where two have just ended
        envs.reset(seed=1)
        for _ in range(4):
            *_, truncated, _ = envs.step(np.ones(envs.action_space.shape))
        assert truncated.all()
        envs.reset(options={"reset_mask": np.array([False, True, False])} | task)
    assert data_equivalence(ours.step(ours.action_space.sample() * 0), theirs.step(ours.action_space.sample() * 0))


@pytest.mark.parametrize(
    "mask", [[True] * 3, np.ones(3), np.ones(2, bool), np.zeros(3, bool), np.ones((3, 1), bool), None]
)
def test_a_mask_that_is_none_is_refused(mask):
    with pytest.raises(RebodyError, match=r"reset_mask must be a boolean array of shape \(3,\) with a True in it"):
        vector(IDS[0]).reset(options={"reset_mask": mask})


@pytest.mark.parametrize("name", [*IDS, TRACKER])
def test_no_step_before_a_reset(name):
    env = gymnasium.make(name).unwrapped
    with pytest.raises(RebodyError, match="call reset before step"):
        env.step(np.zeros(env.action_space.shape))


@pytest.mark.parametrize("name", IDS)
def test_no_step_before_all_were_reset(name):
    envs = vector(name)
    for _ in range(2):
        with pytest.raises(RebodyError, match="call reset before step"):
            envs.step(np.zeros(envs.action_space.shape))
        envs.reset(options={"reset_mask": np.array([True, False, False])})
    envs.reset(options={"reset_mask": np.array([False, True, True])})
    envs.step(np.zeros(envs.action_space.shape))


@pytest.mark.parametrize("name", IDS)
def test_closing_releases_the_camera_alone(name):
    """It may be done twice; a picture before a reset is of the rest pose, one after closing is as before."""
    env = gymnasium.make(name, render_mode="rgb_array").unwrapped
    assert env.render().shape == (480, 640, 3)
    env.close()
    env.reset(seed=0)
    picture = env.render()
    env.close()
    env.close()
    np.testing.assert_array_equal(env.render(), picture)
    env.step(np.zeros(env.action_space.shape))
    env.close()
    envs = vector(name, render_mode="rgb_array")
    envs.close()
    envs.close()
    envs.reset(seed=0)
    assert envs.step(np.zeros(envs.action_space.shape))[0].shape[0] == len(envs.render()) == 3
    envs.close_extras()
