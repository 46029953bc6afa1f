"""What a meta-training run has reached, measured on the toy with tasks that it never trains on."""

from collections.abc import Iterator
from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Bool, Float, Int

from rebody.agents.agent import Reader
from rebody.agents.build import build_agent
from rebody.agents.parts import Inference, InferenceParts
from rebody.agents.rollout import Episodes, rollout_on_toy
from rebody.bodies.toys import Toy
from rebody.inference.contract import Contract
from rebody.inference.probe import Probe, fit_probe
from rebody.inference.reader import PlaceReader
from rebody.inference.sharpened import can_sharpen
from rebody.tasks import Family, FamilySet
from rebody.tasks.figures import Series
from rebody.tasks.quantities import length
from rebody.training.held_out import errors_of
from rebody.training.inference.clusters import agreement, draw, new_mixture
from rebody.training.inference.config import MetaConfig
from rebody.training.inference.coverage import coverage
from rebody.training.inference.episodes import ToyWorld
from rebody.types import DECISION_DT, Task

BASE_TASK_AT = 10
"""Decisions after which the base task (family and direction) should be known."""
PROBED_FROM = 20
"""A probe is fitted on the beliefs from this decision on."""
SHARP_AT = 50
"""Decisions after which a target should read out sharply, whatever disturbs the toy."""
NOISES = (0.0, 0.01)
"""Standard deviations of noise on rewards, in their unit, with which coverage is measured."""
FEW = 100
"""Held-out tasks of an exact posterior by particles: it costs as much as a hundred beliefs."""
CLUSTERED = (2_000, 10_000)
"""Beliefs of a fit of the mixture."""


@dataclass(frozen=True)
class Outcome:
    """Held-out tasks and what was done on them."""

    families: FamilySet
    tasks: Task  # the active ones [time, episode]
    episodes: Episodes

    @property
    def total_return(self) -> float:
        """Mean over episodes of the summed reward."""
        return float(self.episodes.reward.sum(0).mean())

    @property
    def figures(self) -> dict[str, float]:
        """Final errors of each family, and the return."""
        last = jax.tree.map(lambda leaf: leaf[-1], self.tasks)
        return errors_of(self.families, last, self.episodes.state) | {"return": self.total_return}


def measure(parts: InferenceParts, toy: Toy, config: MetaConfig, held_out: int) -> dict[str, float]:
    """Final errors [m, m/s, rad], return and the oracle's, and how sharply beliefs read out."""
    probe, outcome = reader(parts, toy, config, held_out), act("reuse", parts, toy, config, held_out)
    oracle = act("oracle", parts, toy, config, held_out)
    return outcome.figures | {"oracle return": oracle.total_return} | _readings(probe, outcome)


def measure_in_depth(parts: InferenceParts, toy: Toy, config: MetaConfig, held_out: int) -> dict[str, float]:
    """`measure`, and: the return with the exact posterior, sharpness on disturbed toys, coverage of sharpened
    beliefs, changes of the task, and clusters where there is a mixture."""
    probe, outcome = reader(parts, toy, config, held_out), act("reuse", parts, toy, config, held_out)
    figures = outcome.figures
    figures |= _beside_the_exact_posterior(parts, toy, config, held_out)
    figures["oracle return"] = act("oracle", parts, toy, config, held_out).total_return
    figures |= _readings(probe, outcome)
    figures |= _sharpness(probe, act("reuse", parts, toy, config, held_out, disturbed=True))
    figures |= _coverage(parts, toy, config, held_out)
    figures |= changes(probe, act("reuse", parts, toy, config, held_out, switch_share=1.0))
    return figures | (_clusters(outcome, config) if config.prior == "mixture" else {})


def _beside_the_exact_posterior(parts: InferenceParts, toy: Toy, config: MetaConfig, held_out: int) -> dict[str, float]:
    """Its return; by particles on few tasks, with what beliefs get on the same."""
    if config.families.size == 1 or held_out <= FEW:
        return {"bayes return": act("bayes", parts, toy, config, held_out).total_return}
    returns = {kind: act(kind, parts, toy, config, FEW).total_return for kind in ("bayes", "reuse")}
    return {f"{kind} return, {FEW} held-out tasks": value for kind, value in returns.items()}


def act(
    kind: str,
    parts: InferenceParts,
    toy: Toy,
    config: MetaConfig,
    held_out: int,
    *,
    seed: int = 2,
    disturbed: bool = False,
    switch_share: float = 0.0,
    reward_noise: float = 0.0,
    sharpen: bool = False,
) -> Outcome:
    """An agent of a named kind on held-out tasks; the seeds are none that training uses. Beliefs are sharpened where
    that is asked for, and where the policy goes by tasks."""
    key, decisions = jax.random.fold_in(jax.random.key(2**31 - 1), seed), round(config.held_out_s / DECISION_DT)
    world = ToyWorld(config.families, config.randomisation)
    tasks, disturbance = world.draw(key, held_out, decisions, switch_share, disturbed=disturbed)
    inference = Inference("in training", contract_of(config), parts, toy)
    agent = build_agent(kind, inference, tasks, horizon=1, sharpen=sharpen or config.acts_by == "task")
    episodes = rollout_on_toy(agent, toy, tasks, config.families, disturbance, reward_noise)
    return Outcome(config.families, *jax.tree.map(np.asarray, (tasks, episodes)))


def contract_of(config: MetaConfig) -> Contract:
    """What a module of these settings expects of a body."""
    return Contract(
        fields=config.inference.fields,
        window=config.inference.window,
        families=config.families,
        any_law=config.inference.hears_any_law,
    )


def reader(parts: InferenceParts, toy: Toy, config: MetaConfig, held_out: int) -> Probe | PlaceReader:
    """What reads the beliefs of `act`: those that a policy of tasks acts by say their places themselves."""
    if config.acts_by == "task":
        return PlaceReader(parts.module.decoder, config.families)
    return fit(parts, toy, config, held_out)


def fit(parts: InferenceParts, toy: Toy, config: MetaConfig, held_out: int, *, disturbed: bool = False) -> Probe:
    """A probe of other episodes than those that figures are taken on."""
    outcome = act("reuse", parts, toy, config, held_out, seed=3 if disturbed else 1, disturbed=disturbed)
    return probe_of(outcome.families, outcome.tasks, outcome.episodes)


def probe_of(families: FamilySet, tasks: Task, episodes: Episodes) -> Probe:
    """What can be read linearly from the beliefs of episodes."""
    latent = np.asarray(episodes.belief.mean)[PROBED_FROM:]
    family, target = (np.asarray(leaf)[PROBED_FROM:] for leaf in (tasks.family, tasks.target))
    return fit_probe(families, latent.reshape(-1, latent.shape[-1]), family.ravel(), target.reshape(-1, families.size))


def _readings(probe: Reader, outcome: Outcome) -> dict[str, float]:
    """Share of right base tasks, early and later on, and R^2 of each family's target."""
    right = is_right(probe, outcome)
    figures = {"base task": float(right[BASE_TASK_AT - 1].mean()), "base task later": float(right[PROBED_FROM:].mean())}
    for family, missed, wanted in _by_family(probe, outcome):
        missed, wanted = missed[PROBED_FROM:], wanted[PROBED_FROM:]
        figures[f"{family.name} R2"] = float(1 - _spread(missed) / _spread(wanted))
    return figures


def _sharpness(probe: Reader, outcome: Outcome) -> dict[str, float]:
    """Median distance between the target that a disturbed toy's belief speaks of and the true one."""
    return {
        f"{family.name} read, disturbed": float(np.median(length(missed[SHARP_AT])))
        for family, missed, _ in _by_family(probe, outcome)
    }


def _coverage(parts: InferenceParts, toy: Toy, config: MetaConfig, held_out: int) -> dict[str, float]:
    """How often sharpened beliefs cover the truth, with exact rewards and with noisy ones; none where beliefs cannot be
    sharpened."""
    module = parts.module
    if not can_sharpen(module.encoder, module.decoder, config.families):
        return {}
    figures, places = {}, PlaceReader(module.decoder, config.families)
    for noise in NOISES:
        outcome = act("reuse", parts, toy, config, held_out, sharpen=True, reward_noise=noise)
        heard = f", noise {noise:g}" if noise else ""
        shares = coverage(places, config.families, outcome.tasks, outcome.episodes.belief)
        figures |= {f"{name}{heard}": share for name, share in shares.items()}
    return figures


def changes(probe: Reader, outcome: Outcome) -> dict[str, float]:
    """Decisions until a new base task is read rightly (median; all that are left, where it never is), and how often a
    right reading is lost again."""
    label = outcome.families.base_task(outcome.tasks)
    is_new = np.diff(label, axis=0) != 0
    right = is_right(probe, outcome)
    after = [right[t + 1 :, i] for t, i in np.argwhere(is_new)]
    late = [int(np.argmax(of_change)) + 1 if of_change.any() else len(of_change) for of_change in after]
    lost = right[:-1] & ~right[1:] & ~is_new
    figures = {"false changes in 1000": 1000 * float(lost.mean())}
    return figures | ({"decisions to a new base task": float(np.median(late))} if late else {})


def _clusters(outcome: Outcome, config: MetaConfig) -> dict[str, float]:
    """Clusters of beliefs after `PROBED_FROM` decisions, fitted anew, against base tasks and families."""
    rng = np.random.default_rng(0)
    belief = jax.tree.map(lambda leaf: leaf[PROBED_FROM:].reshape(-1, leaf.shape[-1]), outcome.episodes.belief)
    latent, active = draw(belief, config, rng), jax.tree.map(lambda leaf: leaf[PROBED_FROM:], outcome.tasks)
    label, family = np.asarray(outcome.families.base_task(active)).ravel(), np.asarray(active.family).ravel()
    figures = {}
    for size in CLUSTERED:
        chosen = rng.choice(len(latent), min(size, len(latent)), replace=False)
        mixture = new_mixture(config.mixture, rng).fit(latent[chosen])
        cluster = mixture.predict(latent[chosen])
        agrees, of_families = agreement(cluster, label[chosen]), agreement(cluster, family[chosen])
        figures |= {
            f"K of {size} beliefs": float(mixture.n_components_),
            f"purity of {size} beliefs": agrees["purity"],
            f"ARI of {size} beliefs": agrees["ari"],
            f"family purity of {size} beliefs": of_families["purity"],
            f"family ARI of {size} beliefs": of_families["ari"],
        }
    return figures


def read(
    probe: Reader, outcome: Outcome
) -> tuple[Int[np.ndarray, "time episode"], Float[np.ndarray, "time episode axis"]]:
    """Family and target that each belief speaks of."""
    family, target = probe(outcome.episodes.belief)
    return np.asarray(family), np.asarray(target)


def is_right(probe: Reader, outcome: Outcome) -> Bool[np.ndarray, "time episode"]:
    """Whether family and direction are read rightly from each belief."""
    base_task = outcome.families.base_task
    return np.asarray(base_task(Task(*read(probe, outcome))) == base_task(outcome.tasks))


def _by_family(probe: Reader, outcome: Outcome) -> Iterator[tuple[Family, Series, Series]]:
    """Of each family: what its episodes' targets are read wrongly by, and the targets, [time, episode, size]."""
    _, target = read(probe, outcome)
    for i, family in enumerate(outcome.families):
        of_family = np.flatnonzero(outcome.tasks.family[-1] == i)
        said, wanted = (np.asarray(each)[:, of_family, : family.size] for each in (target, outcome.tasks.target))
        yield family, np.asarray(family.quantity.difference(said, wanted)), wanted


def _spread(vectors: Series) -> float:
    """Variance, summed over the numbers of a vector."""
    return float(np.var(vectors, axis=(0, 1)).sum())
