"""What beliefs in the plane are worth: a table, and figures, on the plane's toy with held-out tasks.

    .venv/bin/python benchmarks/plane.py [--inference plane] [--tasks 500] [--out docs/plane]

Every agent acts on the same tasks for 30 s from rest, and on tasks that change once from random starts. `--inference`
takes a shipped name or a folder, several times for several training seeds: figures are then a mean and, behind it,
their standard deviation. The figures are drawn of the first.
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import equinox as eqx
import jax
import numpy as np
from plane_figures import draw_all

from rebody.agents.agent import Agent, Reader
from rebody.agents.build import build_agent
from rebody.agents.parts import Inference, load_inference
from rebody.agents.rollout import rollout_on_toy
from rebody.inference.reader import PlaceReader
from rebody.store import load_artifact
from rebody.tasks import FamilySet
from rebody.training.inference.coverage import REGIONS, coverage
from rebody.training.inference.episodes import ToyWorld
from rebody.training.inference.measure import Outcome, changes, read
from rebody.training.progress import progress
from rebody.types import GlobalState, Task, Tree, global_state

DECISIONS, AT_ONCE = 300, 100
"""Of an episode, and how many episodes are run at once."""
AFTER, COVERED_AFTER = (5, 10, 20), (20, 50)
"""Decisions after which the family is judged, and coverage."""
STARTS = {"from rest": "family after {}", "from random starts": "family after {}, random starts"}
"""How the figures of each are called."""
AWAY = (("x", 15.0), ("y", 15.0), ("vx", 2.0), ("vy", 2.0), ("yaw", np.pi))
"""Random starts: within so much of home [m, m/s, rad]."""


@dataclass(frozen=True)
class Way:
    """How to act."""

    kind: str
    sharpen: bool = False
    believes: bool = True
    says_spreads: bool = True


WAYS = {
    "`reuse`, encoder alone": Way("reuse"),
    "`reuse`": Way("reuse", sharpen=True),
    "`bayes`": Way("bayes", says_spreads=False),
    "`oracle`": Way("oracle", believes=False),
    "`idle`": Way("idle", believes=False),
}
Figures = dict[str, float]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inference", action="append")
    parser.add_argument("--tasks", type=int, default=500)
    parser.add_argument("--out", type=Path, help="folder for the figures, such as docs/plane")
    options = parser.parse_args()
    modules = [load_inference(name) for name in options.inference or ["plane"]]
    measured: dict[str, list[Figures]] = {name: [] for name in WAYS}
    shown: Outcome | None = None
    for i, (reference, module) in enumerate(zip(options.inference or ["plane"], modules, strict=True)):
        world = ToyWorld.of(load_artifact(reference, "inference"))
        for name, way in WAYS.items():
            figures, outcome = figures_of(module, world, way, options.tasks, f"{module.name}, {name.replace('`', '')}")
            measured[name].append(figures)
            shown = outcome if i == 0 and way.sharpen else shown
    print_table(measured, modules[0].contract.families, options.tasks)
    if options.out is not None and shown is not None:
        draw_all(modules[0], shown, options.out)


def figures_of(module: Inference, world: ToyWorld, way: Way, tasks: int, label: str) -> tuple[Figures, Outcome]:
    """All that is measured of one way to act, and what was done from rest."""
    key, families = jax.random.fold_in(jax.random.key(2**31 - 1), 2), world.families
    resting, _ = world.draw(key, tasks, DECISIONS, 0.0, disturbed=False)
    outcome, reader = acted(module, way, resting, at_rest(tasks), label)
    figures = outcome.figures
    if not way.believes:
        return figures, outcome
    for after in AFTER:
        figures[STARTS["from rest"].format(after)] = share_right(reader, outcome, after)
    if way.says_spreads:
        figures |= coverage(places_of(module), families, outcome.tasks, outcome.episodes.belief)
    changing, _ = world.draw(jax.random.fold_in(key, 1), tasks, DECISIONS, 1.0, disturbed=False)
    other, _ = acted(module, way, changing, anywhere(tasks), f"{label}, changing tasks")
    figures |= changes(reader, other)
    for after in AFTER:
        figures[STARTS["from random starts"].format(after)] = share_right(reader, other, after)
    return figures, outcome


def acted(module: Inference, way: Way, tasks: Task, starts: GlobalState, label: str) -> tuple[Outcome, Reader]:
    """What is done on tasks [time, episode], some at a time, so that it is shown how far it is; and what reads the
    beliefs."""
    number, families, parts, agent = tasks.family.shape[1], module.contract.families, [], agent_of(module, way, tasks)
    turns = np.arange(-(-number // AT_ONCE) * AT_ONCE).reshape(-1, AT_ONCE) % number
    with progress(label, len(turns), 0) as show:
        for done, turn in enumerate(turns, 1):
            own, start = taken(tasks, turn, 1), taken(starts, turn, 0)
            episodes = rollout_on_toy(agent_of(module, way, own), module.toy, own, families, start=start)
            parts.append(jax.tree.map(np.asarray, episodes))
            show(done, {})
    episodes = jax.tree.map(lambda *each: joined(each, number), *parts)
    return Outcome(families, jax.tree.map(np.asarray, tasks), episodes), agent.reader


def taken(tree: Tree, some: np.ndarray, along: int) -> Tree:
    """Some entries of each leaf."""
    return jax.tree.map(lambda leaf: np.take(np.asarray(leaf), some, axis=along), tree)


def joined(parts: Sequence[np.ndarray], number: int) -> np.ndarray:
    """The first episodes of turns [time, episode, ...] or [episode]: the last turn is filled up with those of the
    first."""
    along = int(parts[0].ndim > 1)
    return np.take(np.concatenate(parts, axis=along), np.arange(number), axis=along)


def agent_of(module: Inference, way: Way, tasks: Task) -> Agent:
    """Beliefs are read by what the decoder says, the encoder's as well."""
    agent = build_agent(way.kind, module, tasks, horizon=1, sharpen=way.sharpen)
    if way.kind != "reuse" or way.sharpen:
        return agent
    return eqx.tree_at(lambda a: a.reader, agent, places_of(module))


def places_of(module: Inference) -> PlaceReader:
    """What reads the places that beliefs say."""
    return PlaceReader(module.parts.module.decoder, module.contract.families)


def at_rest(number: int) -> GlobalState:
    """Starts at home."""
    return global_state(x=np.zeros(number, np.float32))


def anywhere(number: int) -> GlobalState:
    """Starts at any place, velocity and heading."""
    rng = np.random.default_rng(0)
    return global_state(**{name: rng.uniform(-far, far, number).astype(np.float32) for name, far in AWAY})


def share_right(reader: Reader, outcome: Outcome, after: int) -> float:
    """Of the episodes whose task is still the first: how often the believed family is its own."""
    family, (said, _) = outcome.tasks.family, read(reader, outcome)
    lasts = (outcome.tasks.target[:after] == outcome.tasks.target[0]).all(axis=(0, 2))
    return float(np.mean((said == family)[after - 1, lasts]))


def print_table(measured: dict[str, list[Figures]], families: FamilySet, tasks: int) -> None:
    """In Markdown, a column per way."""
    print(f"| {tasks} held-out tasks, 30 s | {' | '.join(measured)} |\n|---|{'---|' * len(measured)}")
    for row in rows_of(families):
        print(f"| {row.label} | {' | '.join(row.cell(of_way) for of_way in measured.values())} |")


@dataclass(frozen=True)
class Row:
    """Of the table."""

    label: str
    names: Sequence[str]
    """Of its figures."""
    form: str
    times: float = 1.0

    def cell(self, of_modules: list[Figures]) -> str:
        """The means, and their spread where there are several modules; empty for what is not measured."""
        if self.names[0] not in of_modules[0]:
            return ""
        return " / ".join(self._said(np.array([figures[name] for figures in of_modules])) for name in self.names)

    def _said(self, values: np.ndarray) -> str:
        mean = self.form.format(self.times * values.mean())
        return mean if len(values) == 1 else f"{mean} ± {self.form.format(self.times * values.std(ddof=1))}"


def rows_of(families: FamilySet) -> Iterator[Row]:
    """All of them, from above."""
    yield Row("return", ["return"], "{:.2f}")
    for family in families:
        names = [f"{family.name} {figure}" for figure in ("median", "p95")]
        yield Row(f"`{family.name}`, median / 95th percentile [{family.unit}]", names, "{:.4f}")
    after = " / ".join(map(str, AFTER))
    for starts, names in STARTS.items():
        own = [names.format(decisions) for decisions in AFTER]
        yield Row(f"family right after {after} decisions, {starts} [%]", own, "{:.1f}", 100)
    yield Row("decisions to a new base task, median", ["decisions to a new base task"], "{:.0f}")
    yield Row("false changes in 1,000 decisions", ["false changes in 1000"], "{:.1f}")
    for family in families:
        for decisions in COVERED_AFTER:
            regions = [f"{family.name} in {100 * region:.0f} % after {decisions}" for region in REGIONS]
            yield Row(f"`{family.name}` in its regions of 50 / 90 / 99 % after {decisions} [%]", regions, "{:.0f}", 100)


if __name__ == "__main__":
    main()
