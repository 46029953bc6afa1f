"""What a policy does on hidden tasks that are held out from its training: figures of a log, rows of a card."""

from collections.abc import Mapping

import jax
import numpy as np

from rebody.agents.agent import Agent
from rebody.agents.controller import Controller
from rebody.agents.rollout import Episodes, rollout_on_robot
from rebody.bodies import RobotSpec
from rebody.tasks import FamilySet
from rebody.tasks.family_set import sample
from rebody.tasks.figures import final_error
from rebody.types import DECISION_DT, GlobalState, Task


def act(
    agent: Agent,
    controller: Controller,
    spec: RobotSpec,
    families: FamilySet,
    size: int,
    seconds: float,
    seed: int = 0,
) -> tuple[Task, Episodes]:
    """So many episodes, each on one task to the end; tasks are [decision, episode]."""
    task, decisions = sample(families, jax.random.key(2**31 - 1 - seed), (size,)), round(seconds / DECISION_DT)
    lasting = jax.tree.map(lambda leaf: np.repeat(np.asarray(leaf)[None], decisions, axis=0), task)
    return lasting, rollout_on_robot(agent, controller, spec, lasting, families, np.arange(size))


def errors_of(families: FamilySet, tasks: Task, states: GlobalState) -> dict[str, float]:
    """Median and 95th percentile of the final error of each family [m, m/s, rad]; states are [decision, episode]."""
    errors, figures = final_error(families, tasks, states), {}
    for family in np.unique(tasks.family):
        of_family, name = errors[tasks.family == family], families[family].name
        figures[f"{name} median"] = float(np.median(of_family))
        figures[f"{name} p95"] = float(np.percentile(of_family, 95))
    return figures


def figures_of(families: FamilySet, tasks: Task, episodes: Episodes) -> dict[str, float]:
    """Errors on the last tasks of episodes, return, share that fell."""
    errors = errors_of(families, jax.tree.map(lambda leaf: leaf[-1], tasks), episodes.state)
    return errors | {
        "return": float(np.sum(episodes.reward, axis=0).mean()),
        "fell": float(np.mean(episodes.fell)),
    }


def rows_of(families: FamilySet, figures: Mapping[str, float], size: int, seconds: float) -> dict[str, str]:
    """The same for a card, with what they were taken on."""
    rows, condition = {}, f"{size} held-out tasks, {seconds:g} s"
    for name, unit in ((family.name, family.unit) for family in families if f"{family.name} median" in figures):
        rows[f"{name} median, {condition}"] = f"{figures[f'{name} median']:.4f} {unit}"
        rows[f"{name} 95th percentile, {condition}"] = f"{figures[f'{name} p95']:.4f} {unit}"
    return rows | {f"return, {condition}": f"{figures['return']:.1f}", "fell": f"{100 * figures['fell']:.1f} %"}
