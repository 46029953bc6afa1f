"""What a meta-training run has reached, measured on the toy, and the artifact that it leaves behind."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rebody.agents.agent import OracleAgent, ReuseAgent
from rebody.agents.parts import InferenceParts, task_code
from rebody.agents.rollout import Episodes, rollout_on_toy
from rebody.bodies.toys import Disturbance, Toy, describe_toy, no_disturbance
from rebody.inference.contract import Contract
from rebody.inference.probe import Probe, fit_probe
from rebody.store import save_artifact
from rebody.tasks import FAMILIES, family_index
from rebody.tasks.figures import final_error
from rebody.training.card import card
from rebody.training.inference.config import MetaConfig
from rebody.training.run import Run
from rebody.types import Task

DECISIONS = 200
HELD_OUT = 200
"""Held-out tasks per figure."""
BASE_TASK_AT = 10
"""Decisions after which the base task (family and sign) should be known."""
PROBED_FROM = 20
"""A probe is fitted on the beliefs from this decision on."""


def measure(parts: InferenceParts, toy: Toy, config: MetaConfig) -> dict[str, float]:
    """Final error on held-out tasks [m, m/s], return, the oracle's, and what a linear probe reads from beliefs."""
    fitted = _rollout(parts, toy, config, seed=1)
    tasks, episodes = _rollout(parts, toy, config, seed=2)
    figures = {}
    for name in config.target_ranges:
        of_family = np.flatnonzero(tasks.family == family_index(name))
        errors = [final_error(name, float(tasks.target[i]), np.asarray(episodes.state.x)[:, i]) for i in of_family]
        figures[f"{name} median"] = float(np.median(errors))
        figures[f"{name} p95"] = float(np.percentile(errors, 95))
    figures["return"] = float(episodes.reward.sum(0).mean())
    figures["oracle return"] = float(_rollout(parts, toy, config, seed=2, told=True)[1].reward.sum(0).mean())
    return figures | _readings(_fit(*fitted), tasks, episodes)


def _readings(probe: Probe, tasks: Task, episodes: Episodes) -> dict[str, float]:
    """How well a linear probe reads the task from beliefs: R^2 of each family's target, share of right base tasks."""
    family, target = (np.asarray(part) for part in probe(episodes.belief))
    right = (family == tasks.family) & (target * tasks.target > 0)
    figures = {"base task": float(right[BASE_TASK_AT - 1].mean())}
    for index in np.unique(tasks.family):
        of_family = tasks.family == index
        wanted, read = tasks.target[of_family], target[PROBED_FROM:, of_family]
        figures[f"{FAMILIES[index].name} R2"] = float(1 - np.var(read - wanted) / np.var(wanted))
    return figures


def save_inference(parts: InferenceParts, toy: Toy, config: MetaConfig, run: Run, seed: int, title: str) -> Path:
    """Fit the probe, measure, write artifact and card."""
    figures = measure(parts, toy, config)
    rough = _rollout(parts, toy, config, seed=3, disturbed=True)
    probe = _fit(*rough)
    contract = Contract(
        fields=config.inference.fields,
        window=config.inference.window,
        target_ranges=config.target_ranges,
        reward=config.reward,
    )
    parts = eqx.tree_at(lambda p: p.probe, parts, probe)
    stored = {
        "contract": contract.to_config(),
        "inference": asdict(config.inference),
        "high_level": {
            "fields": config.policy_fields,
            "scales": config.policy_scales,
            "hidden": config.sac.hidden,
            "projections": config.sac.projections,
        },
        "toy": describe_toy(toy),
        "training": asdict(config) | {"seed": seed, "wall_s": run.wall_s},
    }
    units = {f"{family.name} {figure}": family.unit for family in FAMILIES for figure in ("median", "p95")}
    rows = {
        f"{name}, {HELD_OUT} held-out tasks, 20 s on the toy": f"{value:.5g} {units.get(name, '')}".rstrip()
        for name, value in figures.items()
    }
    steps = config.iterations * config.episodes * config.decisions
    what = (
        f"Inference module (encoder, decoder, probe) and the toy's high-level policy, trained on a point mass "
        f"on {', '.join(contract.target_ranges)} tasks in {steps:,} toy steps. No robot took part."
    )
    return save_artifact(
        run.out, kind="inference", config=stored, weights=parts, card=card(title, what, run, seed, rows), log=run.log
    )


def _rollout(
    parts: InferenceParts, toy: Toy, config: MetaConfig, seed: int, *, disturbed: bool = False, told: bool = False
) -> tuple[Task, Episodes]:
    """Held-out tasks and what the toy (or its oracle) did on them; the seeds are none that training uses."""
    task_key, disturbance_key = jax.random.split(jax.random.fold_in(jax.random.key(2**31 - 1), seed))
    task = config.tasks.sample(task_key, (HELD_OUT,))
    lasting = jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, (DECISIONS, HELD_OUT)), task)
    listens: Any = {"inferrer": parts.module.encoder, "reader": parts.probe, "stride": 1}
    if told:
        code = task_code(config.target_ranges)
        agent = OracleAgent(**listens, told_policy=parts.told_policy, task_code=code, tasks=lasting)
    else:
        family = config.tasks.families[0]
        agent = ReuseAgent(**listens, high_level=parts.high_level, toy=toy, family=family, horizon=1)
    disturbance: Disturbance = (
        config.randomisation.sample(disturbance_key, (HELD_OUT,)) if disturbed else no_disturbance((HELD_OUT,))
    )
    episodes = rollout_on_toy(agent, toy, lasting, config.reward, disturbance)
    return jax.tree.map(np.asarray, (task, episodes))


def _fit(task: Task, episodes: Episodes) -> Probe:
    latent = np.asarray(episodes.belief.mean)[PROBED_FROM:]
    repeated = jax.tree.map(lambda leaf: np.broadcast_to(leaf, latent.shape[:2]).ravel(), task)
    return fit_probe(latent.reshape(-1, latent.shape[-1]), repeated.family, repeated.target)
