"""Task files: a JSON list of tasks, each with an optional change in mid-episode."""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from msgspec import Meta

from rebody import inputs
from rebody.errors import RebodyError
from rebody.ranges import Finite
from rebody.store.files import TEXT, read_file
from rebody.store.typed import Misfit, typed
from rebody.tasks.family_set import FamilySet
from rebody.types import Task

MOST_TASKS = 20_000
"""In one file; more cannot be evaluated at once, and checking them would take minutes."""
EXAMPLE = '[{"family": "goal", "target": -9.0}]'
Target = tuple[Finite, ...]


@dataclass(frozen=True)
class Switch:
    """Another task from some moment on."""

    at_s: Annotated[float, Meta(ge=0, le=3600)]
    family: str
    target: Target


@dataclass(frozen=True)
class TaskSpec:
    """The task of one episode."""

    family: str
    target: Target
    switch: Switch | None = None

    @property
    def last(self) -> "TaskSpec":
        """The task that the episode ends with, which its final error is taken against."""
        return self if self.switch is None else TaskSpec(self.switch.family, self.switch.target)

    def to_json(self) -> dict[str, Any]:
        """As in a task file; a vector of one is a number."""
        own, switch = {"family": self.family, "target": _plain(self.target)}, None
        if self.switch is not None:
            after = {"family": self.switch.family, "target": _plain(self.switch.target)}
            switch = {"at_s": self.switch.at_s, **after}
        return {**own, "switch": switch}

    @property
    def families(self) -> tuple[str, ...]:
        """Those that are asked for, in their order in time."""
        return tuple(dict.fromkeys((self.family, self.last.family)))


def read_tasks(path: Path, families: FamilySet) -> list[TaskSpec]:
    """The tasks of a file; RebodyError that names the entry and what is wrong with it."""
    return [_task(entry, families, f"{path}, task {i}") for i, entry in enumerate(task_entries(path))]


def task_entries(path: Path) -> list[Any]:
    """What a file lists, whatever it means; RebodyError if it is no list. Ask it before what is slow to load."""
    try:
        content = json.loads(read_file(path, TEXT).decode("utf-8-sig"))
    except FileNotFoundError:
        raise RebodyError(f"there is no task file {path}.") from None
    except (ValueError, RecursionError, OSError) as error:
        raise RebodyError(f"{path} is not a JSON file ({error}). A task file looks like {EXAMPLE}") from None
    if not isinstance(content, list) or not content:
        raise RebodyError(f"{path} must hold a list of at least one task, such as {EXAMPLE}")
    if len(content) > MOST_TASKS:
        raise RebodyError(f"{path} holds {len(content):,} tasks; at most {MOST_TASKS:,} are read. Split it.")
    return content


def parse_task(text: str, families: FamilySet) -> TaskSpec:
    """A task written FAMILY=TARGET, such as goal=-9, or place=3,-2 where a target is a vector."""
    family, equals, target = text.partition("=")
    try:
        numbers = None if "_" in target else [float(number) for number in target.split(",")]
    except ValueError:
        numbers = None
    if not equals or numbers is None:
        raise RebodyError(f"'{text}' is not a task; write FAMILY=TARGET, such as goal=-9 or velocity=1.5.")
    checked = [inputs.number(number, "the target", f"'{text}'") for number in numbers]
    return _task({"family": family, "target": checked}, families, f"'{text}'")


def active_tasks(specs: list[TaskSpec], families: FamilySet, decisions: int, decision_dt: float) -> Task:
    """Which task is on during each decision: arrays [decision, episode]."""
    family = np.zeros((decisions, len(specs)), np.int32)
    target = np.zeros((decisions, len(specs), families.size), np.float32)
    for episode, spec in enumerate(specs):
        begins = decisions if spec.switch is None else round(spec.switch.at_s / decision_dt)
        for when, task in ((slice(begins), spec), (slice(begins, None), spec.last)):
            one = families.task(task.family, task.target)
            family[when, episode], target[when, episode] = one.family, one.target
    return Task(family, target)


def _plain(target: Target) -> float | list[float]:
    return target[0] if len(target) == 1 else list(target)


def _task(entry: Any, families: FamilySet, where: str) -> TaskSpec:
    """A number is a vector of one."""
    try:
        said = typed(_with_vectors(entry), TaskSpec)
        switch = said.switch and replace(said.switch, target=_admitted(said.switch, families))
        return TaskSpec(said.family, _admitted(said, families), switch)
    except Misfit as misfit:
        raise RebodyError(f"{where}: {misfit}. A task looks like {EXAMPLE[1:-1]}") from None
    except RebodyError as error:
        raise RebodyError(f"{where}: {error}") from None


def _admitted(task: Switch | TaskSpec, families: FamilySet) -> Target:
    return families.named(task.family).admit(task.target)


def _with_vectors(entry: Any) -> Any:
    if not isinstance(entry, dict):
        return entry
    target = entry.get("target")
    vector = {"target": [target]} if isinstance(target, int | float) and not isinstance(target, bool) else {}
    return entry | vector | ({"switch": _with_vectors(entry["switch"])} if "switch" in entry else {})
