"""Task files: a JSON list of tasks, each with an optional change in mid-episode."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rebody import inputs
from rebody.errors import RebodyError
from rebody.store.files import TEXT, read_file
from rebody.tasks.families import family_index
from rebody.types import Task

EXAMPLE = '[{"family": "goal", "target": -9.0}]'


@dataclass(frozen=True)
class Switch:
    """Another task from some moment on."""

    at_s: float
    family: str
    target: float


@dataclass(frozen=True)
class TaskSpec:
    """The task of one episode."""

    family: str
    target: float
    switch: Switch | None = None

    @property
    def last(self) -> "TaskSpec":
        """The task that the episode ends with, which its final error is taken against."""
        return self if self.switch is None else TaskSpec(self.switch.family, self.switch.target)


def read_tasks(path: Path) -> list[TaskSpec]:
    """The tasks of a file; RebodyError that names the entry and what is wrong with it."""
    try:
        content = json.loads(read_file(path, TEXT).decode("utf-8-sig"))
    except FileNotFoundError:
        raise RebodyError(f"there is no task file {path}.") from None
    except (ValueError, RecursionError, OSError) as error:
        raise RebodyError(f"{path} is not a JSON file ({error}). A task file looks like {EXAMPLE}") from None
    if not isinstance(content, list) or not content:
        raise RebodyError(f"{path} must hold a list of at least one task, such as {EXAMPLE}")
    return [_task(entry, f"{path}, task {i}") for i, entry in enumerate(content)]


def parse_task(text: str) -> TaskSpec:
    """A task written FAMILY=TARGET, such as goal=-9."""
    family, equals, target = text.partition("=")
    try:
        entry = None if "_" in target else {"family": family, "target": float(target)}
    except ValueError:
        entry = None
    if not equals or entry is None:
        raise RebodyError(f"'{text}' is not a task; write FAMILY=TARGET, such as goal=-9 or velocity=1.5.")
    return _task(entry, f"'{text}'")


def active_tasks(specs: list[TaskSpec], decisions: int, decision_dt: float) -> Task:
    """Which task is on during each decision: arrays [decision, episode]."""
    family = np.array([[family_index(spec.family)] * decisions for spec in specs], np.int32).T
    target = np.array([[spec.target] * decisions for spec in specs], np.float32).T
    for episode, spec in enumerate(specs):
        if spec.switch is not None:
            begins = round(spec.switch.at_s / decision_dt)
            family[begins:, episode] = family_index(spec.switch.family)
            target[begins:, episode] = spec.switch.target
    return Task(family.copy(), target.copy())


def _task(entry: Any, where: str) -> TaskSpec:
    _check_keys(entry, {"family", "target"}, {"switch"}, where)
    switch = entry.get("switch")
    if switch is not None:
        _check_keys(switch, {"at_s", "family", "target"}, set(), f"{where}, switch")
        at_s = inputs.number(switch["at_s"], "'at_s'", f"{where}, switch")
        switch = Switch(at_s, *_family_and_target(switch, f"{where}, switch"))
        if switch.at_s < 0:
            raise RebodyError(f"{where}: the switch cannot be before the start (at_s = {switch.at_s}).")
    return TaskSpec(*_family_and_target(entry, where), switch)


def _check_keys(entry: Any, needed: set[str], allowed: set[str], where: str) -> None:
    if not isinstance(entry, dict):
        raise RebodyError(f"{where}: expected an object such as {EXAMPLE[1:-1]}, got {json.dumps(entry)}")
    if missing := sorted(needed - entry.keys()):
        raise RebodyError(f"{where}: '{missing[0]}' is missing.")
    if unknown := sorted(entry.keys() - needed - allowed):
        raise RebodyError(f"{where}: unknown key '{unknown[0]}'; known are {', '.join(sorted(needed | allowed))}.")


def _family_and_target(entry: dict[str, Any], where: str) -> tuple[str, float]:
    if not isinstance(entry["family"], str):
        raise RebodyError(f"{where}: the family must be a name, got {json.dumps(entry['family'])}.")
    try:
        family_index(entry["family"])
    except RebodyError as error:
        raise RebodyError(f"{where}: {error}") from None
    return entry["family"], inputs.number(entry["target"], "the target", where)
