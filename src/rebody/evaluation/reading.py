"""Results read back from the JSON of an evaluation."""

from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from rebody.errors import RebodyError
from rebody.evaluation.episode import EpisodeResult
from rebody.evaluation.results import VERSION, Results
from rebody.store.files import DATA, read_file
from rebody.store.typed import Misfit, typed
from rebody.tasks import SHIPPED, FamilySet

WANTED = "such a file is written by `rebody evaluate --json`"


def read_results(path: Path, inside: Path | None = None) -> Results:
    """What `save_results` wrote, not outside the folder `inside`; RebodyError that says what is wrong with a file."""
    content = _content(path, read_file(path, DATA, inside))
    if not _holds_results(content):
        raise RebodyError(f"{path} holds no results of an evaluation: {WANTED}.")
    if content["version"] not in _FIELDS_OF_VERSION:
        raise RebodyError(
            f"{path} has version {content['version']}; this rebody reads versions 1 to {VERSION}. "
            "Evaluate anew, or install the version of rebody that made it."
        )
    try:
        families = _families(content)
        episodes = msgspec.convert(content["episodes"], list[dict[str, Any]])
        fields_of = _FIELDS_OF_VERSION[content["version"]]
        entries = [fields_of(entry) | {"families": families} for entry in episodes]
        results = msgspec.convert(content | {"episodes": entries, "family_set": families}, Results)
        _check(results.episodes)
    except (msgspec.ValidationError, Misfit, RebodyError) as error:
        raise RebodyError(f"{path} was edited or cut short: {error}. {WANTED.capitalize()}.") from None
    return results


def holds_results(path: Path, inside: Path | None = None) -> bool:
    """Whether a file is a JSON of an evaluation, be it of another version; RebodyError if it cannot be looked at."""
    data = read_file(path, DATA, inside)
    try:
        return _holds_results(_content(path, data))
    except RebodyError:
        return False


def _content(path: Path, data: bytes) -> Any:
    try:
        return msgspec.json.decode(data)
    except (msgspec.DecodeError, RecursionError) as error:  # deep nesting, too
        raise RebodyError(f"{path} is not a JSON file ({error}): {WANTED}.") from None


def _holds_results(content: Any) -> bool:
    return isinstance(content, dict) and {"version", "agent", "episodes"} <= content.keys()


def _families(content: dict[str, Any]) -> FamilySet:
    """Files of earlier releases do not say which families there were: those that shipped."""
    return typed({"families": content["families"]}, FamilySet) if "families" in content else SHIPPED


def _of_version_2(entry: dict[str, Any]) -> dict[str, Any]:
    """Fields of an `EpisodeResult`."""
    return entry | {"return_": entry.get("return"), "switch": entry.get("switch")}


def _of_version_1(entry: dict[str, Any]) -> dict[str, Any]:
    """It had numbers for vectors, four quantities by names of their own, vz as its largest of a second, no idle."""
    quantities = {name: entry.get(old) for name, old in _QUANTITIES_OF_VERSION_1.items()}
    vectors = {name: _vectors(entry.get(name)) for name in _NUMBERS_OF_VERSION_1}
    switch = entry.get("switch")
    if isinstance(switch, dict):
        vectors["switch"] = switch | {"target": _vectors(switch.get("target"))}
    return _of_version_2(entry) | vectors | {"quantities": quantities, "idle_return": None}


_FIELDS_OF_VERSION = {1: _of_version_1, 2: _of_version_2}
_QUANTITIES_OF_VERSION_1 = {"x": "position_m", "vx": "velocity_m_s", "pitch": "pitch_rad", "vz": "vz_max_m_s"}
_NUMBERS_OF_VERSION_1 = ("target", "active_target", "inferred_target", "subgoal")


def _vectors(value: Any) -> Any:
    """Every number as a vector of one; what is none stays as it is, and is refused by its type."""
    if isinstance(value, list):
        return [_vectors(each) for each in value]
    return [value] if isinstance(value, int | float) else value


def _check(episodes: list[EpisodeResult]) -> None:
    if not episodes:
        raise RebodyError("there is no episode")
    for episode in episodes:
        _check_series(episode)


def _check_series(episode: EpisodeResult) -> None:
    """RebodyError where lists are not as long as the episode, or name a family that there is not, or do not fit it."""
    decisions = len(episode.time_s)
    lists = {name: value for name, value in vars(episode).items() if isinstance(value, list) and name != "target"}
    series = lists | episode.quantities
    if uneven := [name for name, value in series.items() if len(value) != decisions or not value]:
        raise RebodyError(f"an episode of {decisions} decisions has a '{uneven[0]}' of {len(series[uneven[0]])}")
    told = zip(episode.active_family, episode.active_target, strict=True)
    read = zip(episode.inferred_family, episode.inferred_target, strict=True)
    for name, target in {(name, tuple(target)) for name, target in (*told, *read)}:
        family = episode.families.named(name)
        family.admit(target)
        if np.shape(episode.quantities.get(family.quantity.name, [])) not in ((decisions,), (decisions, family.size)):
            raise RebodyError(f"an episode with the family '{name}' lacks its quantity")
