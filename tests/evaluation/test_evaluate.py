"""A whole evaluation on tiny parts, and what is refused before it starts."""

import importlib
import json
from dataclasses import asdict, replace

import equinox as eqx
import numpy as np
import pytest

from rebody.agents.build import check_step_predictor
from rebody.agents.configs import InferenceSettings
from rebody.agents.kinds import KINDS
from rebody.agents.parts import LoadedStepPredictor, inference_template
from rebody.bodies import load_robot
from rebody.bodies.toys import PositionToy
from rebody.errors import RebodyError
from rebody.evaluation import evaluate, save_results
from rebody.evaluation.evaluate import run_trial, take_yardsticks, trial_agent
from rebody.evaluation.trial import POINT_MASS
from rebody.inference.contract import Contract
from rebody.inference.mixture.padded import no_mixture
from rebody.store import tree_hash
from rebody.store.typed import typed
from rebody.tasks import FamilySet, Payment
from rebody.tasks.line import GOAL, STAND, VELOCITY
from rebody.tasks.task_file import Switch, TaskSpec, active_tasks

SPECS = [TaskSpec("goal", (2.0,)), TaskSpec("goal", (1.0,), Switch(1.2, "goal", (-3.0,)))]
SEEDS = 2


@pytest.fixture(scope="module")
def results(trial):
    return evaluate(trial, SPECS, SEEDS)


def test_every_task_once_per_seed(results):
    ran = [(*episode.target, episode.seed) for episode in results.episodes]
    assert ran == [(2.0, 0), (2.0, 1), (1.0, 0), (1.0, 1)]
    assert {len(episode.time_s) for episode in results.episodes} == {30}
    assert (results.robot, results.control_dt, results.tracker, results.horizon) == ("cheetah", 0.05, "tiny-tracker", 5)


def test_every_task_and_seed_has_a_start_of_its_own_whatever_else_is_evaluated(trial, results):
    def starts(results):
        return {(*episode.target, episode.seed): episode.quantities["vx"][0] for episode in results.episodes}

    begins = starts(results)
    assert len({round(start, 3) for start in begins.values()}) == len(begins)
    alone = starts(evaluate(trial, SPECS[1:], 1))
    assert alone[1.0, 0] == pytest.approx(begins[1.0, 0], abs=1e-4)


def test_yardsticks_taken_before_save_time_and_change_nothing(trial, results):
    yardsticks = take_yardsticks(trial, SPECS, SEEDS)
    assert evaluate(trial, SPECS, SEEDS, yardsticks).episodes == results.episodes
    for agent in ("oracle", "idle"):
        told = evaluate(replace(trial, agent=agent), SPECS, SEEDS, yardsticks)
        returns = [getattr(episode, f"{agent}_return") for episode in results.episodes]
        assert returns == pytest.approx([episode.return_ for episode in told.episodes], rel=1e-5)


def test_the_task_changes_at_its_moment(results):
    """Rewards and what is said to be active agree."""
    for episode in results.episodes[SEEDS:]:
        late = np.array(episode.time_s) > 1.2 + 1e-9
        target = np.array(episode.active_target)[:, 0]
        np.testing.assert_array_equal(target, np.where(late, -3.0, 1.0))
        np.testing.assert_allclose(episode.reward, -np.abs(np.array(episode.quantities["x"]) - target), atol=1e-4)
        x = np.array(episode.quantities["x"])[-20:]
        assert episode.final_error == pytest.approx(np.abs(x + 3).mean(), abs=1e-4)


def test_results_say_what_was_frozen(trial, results):
    parts = trial.inference.parts
    assert results.frozen == {"module": tree_hash(parts.module), "policy": tree_hash(parts.high_level)}
    assert len(set(results.frozen.values())) == 2


def test_a_run_that_changes_what_is_frozen_is_none(trial, monkeypatch):
    hashes = iter([{"module": "a"}, {"module": "b"}])
    module = importlib.import_module("rebody.evaluation.evaluate")  # the package gives its function under that name
    monkeypatch.setattr(module, "frozen_hashes", lambda inference: next(hashes))
    with pytest.raises(AssertionError, match="frozen"):
        evaluate(trial, SPECS[:1], 1)


def test_returns_are_sums_of_rewards(results):
    for episode in results.episodes:
        assert episode.return_ == pytest.approx(sum(episode.reward), abs=1e-2)


def test_the_oracle_is_told_the_active_task_and_regrets_nothing(trial, results):
    specs = [*SPECS, TaskSpec("velocity", (-1.5,), Switch(0.5, "goal", (4.0,)))]
    oracle = evaluate(replace(trial, agent="oracle"), specs, 1)
    for episode in oracle.episodes:
        assert episode.subgoal == episode.active_target
        assert episode.subgoal_family == episode.active_family
        assert episode.oracle_return == pytest.approx(episode.return_, rel=1e-6)
    assert oracle.summary["regret"]["value"] == pytest.approx(0.0, abs=1e-6)
    beside = [episode.oracle_return for episode in results.episodes if episode.seed == 0]
    assert beside == pytest.approx([episode.return_ for episode in oracle.episodes[:2]], rel=1e-3)


def test_the_idle_agent_is_the_same_on_every_task(trial):
    idle = replace(trial, agent="idle")
    tasks = active_tasks([TaskSpec("goal", (2.0,)), TaskSpec("goal", (-7.0,))], idle.in_play, idle.decisions, 0.1)
    episodes = run_trial(idle, trial_agent(idle, tasks), tasks, [5, 5])
    np.testing.assert_allclose(episodes.state.x[:, 0], episodes.state.x[:, 1], atol=1e-3)
    assert (episodes.reward[:, 0] != episodes.reward[:, 1]).any()


def on_the_toy(trial, **changes):
    return replace(trial, robot=None, tracker=None, flat=None, **changes)


@pytest.mark.parametrize("agent", [name for name, kind in KINDS.items() if not kind.on_robots_alone])
def test_point_mass(trial, agent):
    results = evaluate(on_the_toy(trial, agent=agent), SPECS, 1)
    assert (results.robot, results.agent, results.tracker, results.control_dt) == (POINT_MASS, agent, None, 0.1)
    oracle = evaluate(on_the_toy(trial, agent="oracle"), SPECS, 1)
    told = [episode.return_ for episode in oracle.episodes]
    assert [episode.oracle_return for episode in results.episodes] == pytest.approx(told, rel=1e-5)
    x = np.array([episode.quantities["x"] for episode in results.episodes])
    if agent == "idle":
        assert not x.any()
    else:
        assert np.abs(x[:, -1]).min() > 0.01


def test_on_the_toy_the_oracle_is_told_the_active_task_and_regrets_nothing(trial):
    oracle = evaluate(on_the_toy(trial, agent="oracle"), SPECS, 1)
    assert [episode.subgoal for episode in oracle.episodes] == [episode.active_target for episode in oracle.episodes]
    assert oracle.summary["regret"]["value"] == pytest.approx(0.0, abs=1e-6)


def test_bayes_reads_the_active_task_from_the_toy(trial):
    """Also after a switch, and told about in the same words as a module's belief."""
    for episode in evaluate(on_the_toy(trial, agent="bayes"), SPECS, 1).episodes:
        known = np.r_[3:12, 15:30] if episode.switch else np.r_[3:30]
        np.testing.assert_allclose(
            np.array(episode.inferred_target)[known], np.array(episode.active_target)[known], atol=0.011
        )
        assert set(episode.inferred_family) == {"goal"}
        assert episode.subgoal[1:] == episode.inferred_target[:-1]


def test_a_point_mass_may_be_another_one_than_the_module_learned_on(trial):
    slow = evaluate(on_the_toy(trial, agent="bayes", toy=PositionToy(max_step=0.02)), SPECS[:1], 1).episodes[0]
    fast = evaluate(on_the_toy(trial, agent="bayes"), SPECS[:1], 1).episodes[0]
    assert np.abs(np.diff(slow.quantities["x"])).max() <= 0.02 + 1e-5
    assert np.abs(np.diff(fast.quantities["x"])).max() > 0.02 + 1e-3


@pytest.mark.parametrize("robot", [True, False])
def test_how_tasks_are_paid(trial, robot):
    """Returns are sums of what is earned, of the yardsticks as well; what the agent hears is another matter."""
    payment = Payment("gaussian", width=4.0, scale=2.0, offset=0.5, noise=0.1, delay_s=0.2, dropped=0.2)
    own = trial if robot else on_the_toy(trial)
    paid = evaluate(replace(own, payment=payment), SPECS, SEEDS)
    for episode in paid.episodes:
        apart = np.array(episode.quantities["x"]) - np.array(episode.active_target)[:, 0]
        np.testing.assert_allclose(episode.reward, 2 * np.exp(-((apart / 4) ** 2)) + 0.5, atol=1e-4)
        assert episode.return_ == pytest.approx(sum(episode.reward), abs=1e-3)
    assert paid.law == payment
    for agent in ("oracle", "idle"):
        told = evaluate(replace(own, payment=payment, agent=agent), SPECS, SEEDS)
        returns = [getattr(episode, f"{agent}_return") for episode in paid.episodes]
        assert returns == pytest.approx([episode.return_ for episode in told.episodes], rel=1e-5)
    assert evaluate(replace(own, payment=payment), SPECS, SEEDS).episodes == paid.episodes


def test_a_payment_like_the_families_own_law_changes_nothing(trial, results):
    assert evaluate(replace(trial, payment=Payment()), SPECS, SEEDS).episodes == results.episodes


@pytest.mark.parametrize(
    ("changes", "says"),
    [({"agent": "bayes"}, "'bayes' believes by the families' own laws"), ({"thesis": True}, "leave --law or --thesis")],
)
def test_where_no_other_law_can_be(trial, changes, says):
    with pytest.raises(RebodyError, match=says):
        evaluate(replace(trial, payment=Payment(), **changes), SPECS, 1)


FAR_AND_NEAR = [TaskSpec("goal", (target,)) for target in (-9.0, -3.0, 3.0, 9.0)]


@pytest.fixture(scope="module")
def latent(trial):
    """What the module believes on the toy, [episode, time, latent]."""
    return np.array([episode.latent for episode in evaluate(on_the_toy(trial), FAR_AND_NEAR, 1).episodes])


@pytest.fixture(scope="module")
def with_mixture(trial, latent):
    """A function: the module with two components in its first dimensions, on either side of what it mostly believes."""

    def make(dimensions):
        mixture, side = no_mixture(3, dimensions), np.eye(dimensions)[0]
        middle = np.median(latent[..., :dimensions], axis=(0, 1))
        mixture.active[:2], mixture.mean[:2] = True, [middle + side, middle - side]
        module = trial.inference
        parts = eqx.tree_at(lambda p: p.mixture, module.parts, mixture, is_leaf=lambda leaf: leaf is None)
        return replace(module, parts=parts)

    return make


@pytest.mark.parametrize("dimensions", [1, 2])
def test_each_belief_has_its_cluster(trial, latent, with_mixture, dimensions):
    """A mixture of fewer dimensions than the latent is that of the first ones."""
    results = evaluate(on_the_toy(trial, inference=with_mixture(dimensions)), FAR_AND_NEAR, 1)
    below = latent[..., 0] < np.median(latent[..., 0])
    np.testing.assert_array_equal([episode.cluster for episode in results.episodes], below.astype(int))
    assert 0.4 < below.mean() < 0.6


def test_who_has_no_latent_that_a_mixture_knows_has_one_cluster(trial, with_mixture):
    for agent, module in (("bayes", with_mixture(2)), ("reuse", trial.inference)):
        episodes = evaluate(on_the_toy(trial, agent=agent, inference=module), SPECS, 1).episodes
        assert {cluster for episode in episodes for cluster in episode.cluster} == {0}


def test_a_module_of_several_families_is_for_the_point_mass_and_for_readout(trial):
    families = FamilySet((GOAL, VELOCITY))
    config = {
        "contract": asdict(replace(trial.inference.contract, families=families)),
        "inference": {"units": 8, "window": 6, "latent": 2},
        "high_level": {"fields": ["x", "vx"], "scales": [10.0, 3.5], "hidden": [8], "projections": 0},
        "toy": {"kind": "mass-damper"},
    }
    settings = typed(config, InferenceSettings)
    parts = eqx.filter_jit(lambda: inference_template(settings))()
    several = replace(trial.inference, contract=settings.contract, parts=parts)
    specs = [TaskSpec("goal", (2.0,)), TaskSpec("velocity", (-1.0,))]
    toy = evaluate(on_the_toy(trial, inference=several), specs, 1)
    assert set(toy.summary["families"]) == {"goal", "velocity"}
    assert evaluate(replace(trial, inference=several, agent="readout"), specs, 1).episodes
    with pytest.raises(RebodyError, match="'tiny' tells several families apart"):
        evaluate(replace(trial, inference=several), specs, 1)


def test_a_flat_policy_has_no_subgoal(trial, tmp_path):
    flat = evaluate(replace(trial, agent="flat"), SPECS[:1], 1)
    assert flat.episodes[0].subgoal == [None] * 30
    oracle = evaluate(replace(trial, agent="oracle"), SPECS[:1], 1)
    assert flat.episodes[0].oracle_return == pytest.approx(oracle.episodes[0].return_, rel=1e-3)
    save_results(flat, tmp_path / "flat.json")
    saved = json.loads((tmp_path / "flat.json").read_text(), parse_constant=pytest.fail)
    assert saved["episodes"][0]["subgoal"] == [None] * 30
    alone = evaluate(replace(trial, agent="flat", tracker=None), SPECS[:1], 1)
    assert alone.episodes[0].quantities["x"] == flat.episodes[0].quantities["x"]
    assert alone.summary["regret"] is None  # a robot's oracle needs a tracker


def test_thesis_mode_with_a_decisions_worth_of_control_steps_is_our_mode(trial, results):
    thesis = evaluate(replace(trial, thesis=True, stride=2), SPECS, SEEDS)
    assert (thesis.thesis, thesis.stride, results.thesis) == (True, 2, False)
    assert thesis.episodes == results.episodes


def test_in_thesis_mode_a_belief_lasts_a_stride(trial, results):
    seldom = evaluate(replace(trial, thesis=True, stride=10), SPECS, SEEDS)  # 0.5 s
    for episode, ours in zip(seldom.episodes, results.episodes, strict=True):
        latent = np.array(episode.latent)
        changes = np.flatnonzero((latent[1:] != latent[:-1]).any(axis=-1)) + 1
        np.testing.assert_array_equal(changes, np.arange(4, 30, 5))
        assert len(episode.time_s) == 30
        assert episode.oracle_return == pytest.approx(ours.oracle_return, rel=1e-6)  # the oracle is no thesis


@pytest.fixture(scope="module")
def predicting(trial, always):
    """A function: steps -> thesis mode with a predictor that always says so."""

    def predicting(steps):
        part = LoadedStepPredictor("tiny-predictor", "cheetah", tree_hash(trial.tracker.tracker), always(steps))
        return replace(trial, thesis=True, step_predictor=part)

    return predicting


def test_a_prediction_that_is_always_the_same_is_a_fixed_stride(trial, predicting):
    predicted = evaluate(predicting(4), SPECS, SEEDS)
    fixed = evaluate(replace(trial, thesis=True, stride=4), SPECS, SEEDS)
    assert predicted.episodes == fixed.episodes
    assert (predicted.stride, fixed.stride) == ("predicted", 4)
    assert predicted.to_json()["stride"] == "predicted"


def test_nothing_that_is_frozen_changes(predicting):
    trial = predicting(3)
    frozen = (trial.inference.parts, trial.tracker.tracker, trial.step_predictor.predictor)
    before = tree_hash(frozen)
    evaluate(trial, SPECS, 1)
    assert tree_hash(frozen) == before


def test_a_step_predictor_that_does_not_fit_is_refused(trial, predicting):
    told = predicting(3)
    for change, said in (
        ({"robot": "walker"}, "'tiny-predictor' was trained on 'walker', not on 'cheetah'"),
        ({"tracker_hash": "0" * 64}, "was trained with another tracker than 'tiny-tracker'"),
    ):
        with pytest.raises(RebodyError, match=said):
            evaluate(replace(told, step_predictor=replace(told.step_predictor, **change)), SPECS, 1)
    stands = replace(trial.inference, contract=replace(trial.inference.contract, families=FamilySet((STAND,))))
    with pytest.raises(RebodyError, match="knows goals and speeds, and 'tiny' may ask for stand"):
        check_step_predictor(told.step_predictor, told.tracker, stands)


def of_another_module(trial):
    return replace(trial.flat, inference_hash="0" * 64)


SEES_YAW = Contract(("yaw",), 6, FamilySet((GOAL,)))
REFUSED = {
    "was trained on 'cheetah', not on 'hopper'": lambda trial: (
        replace(trial, robot=replace(load_robot("cheetah"), name="hopper")), SPECS,
    ),
    "'tiny' was trained on goal and cannot infer 'velocity'": lambda trial: (trial, [TaskSpec("velocity", (1.0,))]),
    "cannot infer 'velocity'.*rebody list": lambda trial: (
        trial, [TaskSpec("goal", (1.0,), Switch(1.0, "velocity", (1.0,)))],
    ),
    "--seconds 2.9 is too short": lambda trial: (replace(trial, seconds=2.9), SPECS),
    "a switch at 3 s is not within an episode of 3 s": lambda trial: (
        trial, [TaskSpec("goal", (1.0,), Switch(3.0, "goal", (2.0,)))],
    ),
    "flat policy 'tiny-flat' was trained on the beliefs of another module than 'tiny'": lambda trial: (
        replace(trial, agent="flat", flat=of_another_module(trial)), SPECS,
    ),
    "'tiny-flat' was trained on 'walker', not on 'cheetah'": lambda trial: (
        replace(trial, agent="flat", flat=replace(trial.flat, robot="walker")), SPECS,
    ),
    "agent 'flat' learned on a robot, and a point mass is none": lambda trial: (
        replace(trial, agent="flat", robot=None), SPECS,
    ),
    "thesis mode is for the agents reuse, retrain, readout, bayes, not for 'oracle'": lambda trial: (
        replace(trial, agent="oracle", thesis=True), SPECS,
    ),
    "thesis mode is for the agents .*not for 'flat'": lambda trial: (
        replace(trial, agent="flat", thesis=True), SPECS,
    ),
    "'tiny' was trained on goal and cannot infer 'velocity'. Choose": lambda trial: (
        replace(trial, agent="oracle", robot=None, tracker=None, flat=None), [TaskSpec("velocity", (1.0,))],
    ),
    "unknown agent 'resue'": lambda trial: (replace(trial, agent="resue"), SPECS),
    "its encoder sees yaw, which 'cheetah' does not have": lambda trial: (
        replace(trial, inference=replace(trial.inference, contract=SEES_YAW)),
        SPECS,
    ),
}  # fmt: skip


@pytest.mark.parametrize("said", REFUSED)
def test_what_does_not_fit_is_refused(trial, said):
    with pytest.raises(RebodyError, match=said):
        evaluate(*REFUSED[said](trial), 1)
