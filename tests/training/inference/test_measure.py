"""Figures of a run: by hand, from episodes whose beliefs say what a known probe is to read."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from rebody.agents.rollout import Episodes
from rebody.bodies.toys import FullToy, MassDamper, describe_toy
from rebody.inference.probe import Probe
from rebody.ranges import interval
from rebody.tasks import FamilySet, line
from rebody.tasks.line import both_ways
from rebody.training.inference import measure
from rebody.training.inference.config import MixtureConfig
from rebody.training.inference.measure import Outcome, act, contract_of, fit, is_right, measure_in_depth, read
from rebody.training.inference.train import initial_state, trained_parts
from rebody.types import GLOBAL_FIELDS, Belief, GlobalState, Subgoal, Task


@pytest.fixture(scope="module")
def parts(config, state):
    """Of a run that has not begun."""
    return trained_parts(state, config)


GOAL, VELOCITY = range(2)
FAMILIES = FamilySet(
    (
        line.GOAL.within(*both_ways(2.0, 9.0), law="plain"),
        line.VELOCITY.within(*both_ways(1.0, 3.0), law="plain"),
    )
)
TOLD = np.array([[0.0, 0.0], [1.0, 1.0], [0.0, 0.0]], np.float32)
PROBE = Probe(np.array([[-1.0, 1.0], [0.0, 0.0], [0.0, 0.0]], np.float32), TOLD, FAMILIES)
"""Reads the family from the sign of the first number of a latent, the target from the second."""


def latent_of(family, target):
    """What `PROBE` reads as this task."""
    kind = np.where(family == VELOCITY, 1.0, -1.0)
    return np.stack(np.broadcast_arrays(kind, target[..., 0]), axis=-1).astype(np.float32)


def outcome_of(tasks, latent, variance=1e-8, **fields):
    """Episodes with these beliefs; fields of the state and `reward` that are not given are 0."""
    still = np.zeros(tasks.family.shape, np.float32)
    state = GlobalState(**{name: np.asarray(fields.get(name, still), np.float32) for name in GLOBAL_FIELDS})
    return Outcome(
        FAMILIES,
        tasks,
        Episodes(
            state=state,
            reward=fields.get("reward", still),
            belief=Belief(latent, np.full_like(latent, variance)),
            subgoal=Subgoal(tasks.family, still[..., None]),
            fell=np.zeros(still.shape[1], bool),
        ),
    )


def lasting(families, targets, time):
    """Tasks [time, episode] that do not change."""
    shape = (time, len(families))
    return Task(
        np.broadcast_to(np.asarray(families, np.int32), shape).copy(),
        np.broadcast_to(np.asarray(targets, np.float32)[:, None], (*shape, 1)).copy(),
    )


def test_a_reading_is_right_when_family_and_sign_are():
    tasks = lasting([GOAL, GOAL, VELOCITY, VELOCITY, GOAL], [3.0, 3.0, -1.0, -1.0, 3.0], 1)
    says = Task(np.array([[GOAL, GOAL, VELOCITY, GOAL, VELOCITY]]), np.array([[9.0, -3.0, -0.1, -1.0, 3.0]])[..., None])
    outcome = outcome_of(tasks, latent_of(says.family, says.target))
    family, target = read(PROBE, outcome)
    np.testing.assert_array_equal(family, says.family)
    np.testing.assert_allclose(target, says.target, rtol=1e-6)
    np.testing.assert_array_equal(is_right(PROBE, outcome), [[True, False, True, False, False]])


CHANGES_AT, LATE = 20, 4


@pytest.fixture
def changing():
    """Two episodes of 51 decisions; at the 20th one goes from a goal in front to a speed, the other to behind."""
    is_late = np.arange(51)[:, None] >= CHANGES_AT
    tasks = Task(
        np.where(is_late, [[VELOCITY, GOAL]], GOAL).astype(np.int32),
        np.where(is_late, [[2.0, -6.0]], [[5.0, 5.0]]).astype(np.float32)[..., None],
    )
    says = jax.tree.map(lambda leaf: np.concatenate([leaf[:1].repeat(LATE - 1, axis=0), leaf[: -LATE + 1]]), tasks)
    return outcome_of(tasks, latent_of(says.family, says.target))  # it takes three decisions to notice


def said(outcome, changes):
    """The same, but at each of some (decision, episode) the other sign is read."""
    latent = outcome.episodes.belief.mean.copy()
    for where in changes:
        latent[where][1] *= -1
    return outcome_of(outcome.tasks, latent)


def test_decisions_until_a_new_base_task_is_read(changing):
    figures = measure.changes(PROBE, changing)
    assert figures["decisions to a new base task"] == LATE  # rewards of the new task that were heard
    assert figures["false changes in 1000"] == 0.0  # the change itself is none


def test_a_right_reading_that_is_lost_is_a_false_change(changing):
    """Two of 100 pairs of decisions, one of them twice as long: a loss counts once."""
    lost = said(changing, [(10, 0), (40, 1), (41, 1)])
    figures = measure.changes(PROBE, lost)
    assert figures["false changes in 1000"] == pytest.approx(1000 * 2 / 100)
    assert figures["decisions to a new base task"] == LATE


def test_what_is_not_right_yet_cannot_be_lost(changing):
    """Wrong from the start on, and wrong again right after the change."""
    wrong = said(changing, [(0, 0), (1, 0), (CHANGES_AT, 0), (CHANGES_AT + 1, 0)])
    assert measure.changes(PROBE, wrong) == {"decisions to a new base task": LATE, "false changes in 1000": 0.0}


def test_the_median_is_over_changes(changing):
    """One of them read at once, the other after ten decisions."""
    latent = changing.episodes.belief.mean.copy()
    new = latent_of(changing.tasks.family, changing.tasks.target)
    latent[CHANGES_AT:, 0] = new[CHANGES_AT:, 0]
    latent[CHANGES_AT : CHANGES_AT + 9, 1] = latent[0, 1]
    figures = measure.changes(PROBE, outcome_of(changing.tasks, latent))
    assert figures["decisions to a new base task"] == (1 + 10) / 2


def test_another_target_of_the_same_base_task_is_no_new_one(changing):
    tasks = changing.tasks
    farther = Task(tasks.family, np.where(np.arange(51)[:, None, None] > 35, 1.5 * tasks.target, tasks.target))
    latent = changing.episodes.belief.mean
    assert measure.changes(PROBE, outcome_of(farther, latent)) == measure.changes(PROBE, changing)


TIME = 60


@pytest.fixture
def settings(config):
    """Goals and speeds with a mixture."""
    inference = replace(config.inference, fields=("x", "vx"), scales=(10.0, 3.0), kinds=0)
    mixture = MixtureConfig(maximum=8)
    return replace(config, families=FAMILIES, inference=inference, prior="mixture", mixture=mixture)


def known(size, seed=0):
    """Tasks of all four base tasks in turn, which last."""
    rng = np.random.default_rng(seed)
    families = np.arange(size) // 2 % 2
    targets = np.where(np.arange(size) % 2, 1, -1) * np.where(
        families, rng.uniform(1, 3, size), rng.uniform(2, 9, size)
    )
    return lasting(families, targets, TIME)


@pytest.fixture
def clairvoyant(settings, monkeypatch):
    """A run whose every agent does what is known; calls (kind, options) of `act` are noted."""
    calls = []

    def acts(kind, parts, toy, config, held_out, **options):
        calls.append((kind, options))
        tasks = known(held_out, options.get("seed", 2))
        if options.get("switch_share"):
            tasks = jax.tree.map(lambda leaf: np.concatenate([leaf[:30], np.roll(leaf[30:], 1, 1)]), tasks)
        latent = latent_of(tasks.family, tasks.target)
        latent[..., 1] += 0.25 if options.get("disturbed") else 0.0
        latent[: measure.BASE_TASK_AT - 1] *= -1  # it knows nothing before
        off, target = np.linspace(0.0, 0.3, held_out), tasks.target[..., 0]
        fields = {
            "x": np.where(tasks.family == GOAL, target + off, 0.1 * np.arange(TIME)[:, None] * target),
            "vx": np.where(tasks.family == GOAL, 0.0, target),
        }
        paid = {"reuse": -2.0, "oracle": -1.0, "bayes": -1.5}[kind]
        return outcome_of(tasks, latent, reward=np.full(tasks.family.shape, paid, np.float32), **fields)

    monkeypatch.setattr(measure, "act", acts)
    return calls


def test_what_is_measured_while_it_trains(clairvoyant, parts, settings):
    figures = measure.measure(parts, MassDamper(), settings, 40)
    off = np.linspace(0.0, 0.3, 40)[known(40).family[0] == GOAL]
    assert figures == pytest.approx(
        {
            "goal median": np.median(off),
            "goal p95": np.percentile(off, 95),
            "velocity median": 0.0,
            "velocity p95": 0.0,
            "return": -2.0 * TIME,
            "oracle return": -1.0 * TIME,
            "base task": 1.0,
            "base task later": 1.0,
            "goal R2": 1.0,
            "velocity R2": 1.0,
        },
        abs=1e-3,
    )
    assert list(dict.fromkeys(kind for kind, _ in clairvoyant)) == ["reuse", "oracle"]
    seeds = [options.get("seed", 2) for kind, options in clairvoyant]
    assert seeds == [1, 2, 2]  # the probe is of other episodes than the figures


def test_what_is_measured_in_the_end(clairvoyant, parts, settings):
    figures = measure_in_depth(parts, MassDamper(), settings, 40)
    briefly = measure.measure(parts, MassDamper(), settings, 40)
    assert {name: figures[name] for name in briefly} == briefly
    assert figures["bayes return"] == -1.5 * TIME
    assert figures["goal read, disturbed"] == pytest.approx(0.25, abs=1e-3)
    assert figures["velocity read, disturbed"] == pytest.approx(0.25, abs=1e-3)
    assert figures["decisions to a new base task"] == 1.0
    assert figures["false changes in 1000"] == 0.0
    assert figures["family purity of 2000 beliefs"] == 1.0
    assert {"disturbed": True} in [options for _, options in clairvoyant]
    assert {"switch_share": 1.0} in [options for _, options in clairvoyant]


def test_without_a_mixture_there_are_no_clusters(clairvoyant, parts, settings):
    figures = measure_in_depth(parts, MassDamper(), replace(settings, prior="gaussian"), 8)
    assert not [name for name in figures if "beliefs" in name]


def test_a_target_is_as_sharp_as_at_its_decision():
    tasks = known(8)
    latent = latent_of(tasks.family, tasks.target)
    off = np.where(tasks.family == GOAL, 0.5, -0.125)
    latent[..., 1] += np.where(np.arange(TIME)[:, None] == measure.SHARP_AT, off, 9.0)
    figures = measure._sharpness(PROBE, outcome_of(tasks, latent))
    assert figures == pytest.approx({"goal read, disturbed": 0.5, "velocity read, disturbed": 0.125}, abs=1e-5)


def test_readings_are_judged_at_their_decisions():
    """Of four episodes one is read wrongly at the tenth decision; goals are read as half of what they are."""
    tasks = known(4)
    latent = latent_of(tasks.family, tasks.target)
    latent[..., 1] *= np.where(tasks.family == GOAL, 0.5, 1.0)
    latent[: measure.PROBED_FROM, :, 1] *= 100
    latent[measure.BASE_TASK_AT - 1, 2, 1] *= -1
    latent[measure.PROBED_FROM :: 2, 0] *= -1  # and one later on, family and sign, at every other decision
    figures = measure._readings(PROBE, outcome_of(tasks, latent))
    assert (figures["base task"], figures["base task later"]) == (0.75, 0.875)
    assert figures["velocity R2"] == pytest.approx(1.0, abs=1e-5)
    latent[measure.PROBED_FROM :: 2, 0] *= -1
    assert measure._readings(PROBE, outcome_of(tasks, latent))["goal R2"] == pytest.approx(0.75, abs=1e-5)


def test_a_probe_is_fitted_on_what_is_believed_late(clairvoyant, parts, settings):
    """Before that, here, its beliefs say the contrary."""
    probe = fit(parts, MassDamper(), settings, 40)
    tasks = known(6, seed=9)
    family, target = read(probe, outcome_of(tasks, latent_of(tasks.family, tasks.target)))
    np.testing.assert_array_equal(family, tasks.family)
    np.testing.assert_allclose(target, tasks.target, atol=1e-2)
    rough = fit(parts, MassDamper(), settings, 40, disturbed=True)
    _, lower = read(rough, outcome_of(tasks, latent_of(tasks.family, tasks.target)))
    np.testing.assert_allclose(lower, tasks.target - 0.25, atol=1e-2)
    (_, calm), (_, disturbed) = clairvoyant
    assert (calm["disturbed"], disturbed["disturbed"]) == (False, True)
    assert len({calm["seed"], disturbed["seed"], 2}) == 3


@pytest.mark.parametrize(
    ("centres", "expected"),
    [
        ([[-3, -3], [-3, 3], [3, -3], [3, 3]], {"K": 4.0, "purity": 1.0, "ARI": 1.0, "family purity": 1.0}),
        ([[-3, 0], [-3, 0], [3, 0], [3, 0]], {"K": 2.0, "purity": 0.5, "family purity": 1.0, "family ARI": 1.0}),
        ([[-3, 0], [3, 0], [-3, 0], [3, 0]], {"K": 2.0, "purity": 0.5, "family purity": 0.5, "family ARI": 0.0}),
    ],
)
def test_clusters_of_beliefs_that_lie_about_known_points(settings, monkeypatch, centres, expected):
    """One point for each base task; one for each family; one for each direction."""
    monkeypatch.setattr(measure, "CLUSTERED", (300, 100_000))
    tasks = known(40)
    latent = np.array(centres, np.float32)[FAMILIES.base_task(tasks)]
    latent[: measure.PROBED_FROM] = 50.0  # before, they are elsewhere
    figures = measure._clusters(outcome_of(tasks, latent, variance=0.04), settings)
    for size in (300, 100_000):
        found = {name: figures[f"{name} of {size} beliefs"] for name in expected}
        assert found == pytest.approx(expected, abs=0.08)  # 300 are not just a quarter of each
    assert len(figures) == 10


@pytest.fixture
def short(config):
    return replace(config, held_out_s=3.0)


def assert_same(one, other):
    jax.tree.map(np.testing.assert_array_equal, (one.tasks, one.episodes), (other.tasks, other.episodes))


def test_held_out_tasks_are_the_same_for_every_agent(parts, short):
    outcomes = {kind: act(kind, parts, MassDamper(), short, 5) for kind in ("reuse", "oracle", "bayes")}
    for outcome in outcomes.values():
        assert outcome.tasks.family.shape == outcome.episodes.reward.shape == (30, 5)
        np.testing.assert_array_equal(outcome.tasks.target, outcomes["reuse"].tasks.target)
        assert (np.diff(outcome.tasks.target, axis=0) == 0).all()
        missed = np.abs(outcome.episodes.state.x - outcome.tasks.target[..., 0])
        np.testing.assert_allclose(outcome.episodes.reward, -missed, rtol=1e-5)
        assert outcome.total_return == pytest.approx(-missed.sum(axis=0).mean(), rel=1e-5)
    np.testing.assert_array_equal(outcomes["oracle"].episodes.subgoal.value, outcomes["oracle"].tasks.target)
    found = outcomes["bayes"].episodes.belief.mean[-1, :, 1]
    np.testing.assert_allclose(found, outcomes["bayes"].tasks.target[-1, :, 0], atol=0.02)
    assert_same(act("reuse", parts, MassDamper(), short, 5), outcomes["reuse"])


def test_other_seeds_are_other_tasks(parts, short):
    one, other = (act("reuse", parts, MassDamper(), short, 5, seed=seed).tasks.target for seed in (1, 2))
    assert not set(one[0, :, 0]) & set(other[0, :, 0])


def test_disturbances_come_on_the_same_tasks(parts, short):
    calm, rough = (act("reuse", parts, MassDamper(), short, 5, disturbed=flag) for flag in (False, True))
    np.testing.assert_array_equal(calm.tasks.target, rough.tasks.target)
    np.testing.assert_array_equal(calm.episodes.state.x[0], calm.episodes.state.vx[0] * np.float32(0.1))
    assert np.abs(calm.episodes.state.vx - rough.episodes.state.vx).max(axis=0).min() > 0.01


def test_held_out_tasks_can_change(parts, short):
    switching = act("reuse", parts, MassDamper(), short, 20, switch_share=1.0)
    assert ((np.diff(switching.tasks.target, axis=0) != 0).sum(axis=0) == 1).all()
    missed = np.abs(switching.episodes.state.x - switching.tasks.target[..., 0])
    np.testing.assert_allclose(switching.episodes.reward, -missed, rtol=1e-5)


def test_agents_of_the_full_toy_move_it_in_every_way(short):
    families = FamilySet((line.GOAL.within(interval(2.0, 9.0)), line.STAND.within(interval(0.5, 1.5))))
    inference = replace(short.inference, fields=("x", "pitch"), scales=(10.0, 1.5), latent=3, kinds=1, window=None)
    full = replace(short, families=families, inference=inference, toy="full")
    fresh = trained_parts(initial_state(full, FullToy(), jax.random.key(0)), full)
    for kind in ("reuse", "oracle"):
        state = act(kind, fresh, FullToy(), full, 4).episodes.state
        assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(state))
        assert np.abs(state.pitch).max(axis=0).min() > 0
    assert contract_of(full).families == families


def test_the_contract_says_what_was_trained(config):
    contract = contract_of(replace(config, inference=replace(config.inference, window=None)))
    assert contract.fields == config.inference.fields
    assert contract.window is None
    assert contract.families == config.families
    assert describe_toy(FullToy())["kind"] == "full"
