"""Results read back from the JSON of an evaluation."""

from pathlib import Path
from typing import Any

import msgspec

from rebody.errors import RebodyError
from rebody.evaluation.episode import VECTORS, EpisodeResult
from rebody.evaluation.results import VERSION, Results
from rebody.store.files import DATA, read_file
from rebody.tasks import family_named

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
        episodes = msgspec.convert(content["episodes"], list[dict[str, Any]])
        fields_of = _FIELDS_OF_VERSION[content["version"]]
        results = msgspec.convert(content | {"episodes": [fields_of(entry) for entry in episodes]}, Results)
        _check(results.episodes)
    except (msgspec.ValidationError, RebodyError) as error:
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


def _of_version_2(entry: dict[str, Any]) -> dict[str, Any]:
    """Fields of an `EpisodeResult`; vectors have one number so far."""
    vectors = {name: _numbers(entry.get(name)) for name in VECTORS}
    return entry | vectors | {"return_": entry.get("return"), "switch": entry.get("switch")}


def _of_version_1(entry: dict[str, Any]) -> dict[str, Any]:
    """It had numbers for vectors, four quantities by names of their own, vz as its largest of a second, no idle."""
    quantities = {name: entry.get(old) for name, old in _QUANTITIES_OF_VERSION_1.items()}
    return entry | {
        "quantities": quantities, "idle_return": None, "return_": entry.get("return"), "switch": entry.get("switch"),
    }  # fmt: skip


_FIELDS_OF_VERSION = {1: _of_version_1, 2: _of_version_2}
_QUANTITIES_OF_VERSION_1 = {"x": "position_m", "vx": "velocity_m_s", "pitch": "pitch_rad", "vz": "vz_max_m_s"}


def _numbers(value: Any) -> Any:
    """Vectors of one as numbers; what is none stays as it is, and is refused by its type."""
    if not isinstance(value, list):
        return value
    if len(value) == 1 and not isinstance(value[0], list):
        return value[0]
    return [_numbers(each) for each in value]


def _check(episodes: list[EpisodeResult]) -> None:
    if not episodes:
        raise RebodyError("there is no episode")
    for episode in episodes:
        _check_series(episode)


def _check_series(episode: EpisodeResult) -> None:
    """RebodyError where lists are not as long as the episode, or name a family that there is not."""
    decisions = len(episode.time_s)
    series = {name: value for name, value in vars(episode).items() if isinstance(value, list)} | episode.quantities
    if uneven := [name for name, value in series.items() if len(value) != decisions or not value]:
        raise RebodyError(f"an episode of {decisions} decisions has a '{uneven[0]}' of {len(series[uneven[0]])}")
    for family in {*episode.active_family, *episode.inferred_family}:
        if family_named(family).quantity.name not in episode.quantities:
            raise RebodyError(f"an episode with the family '{family}' lacks its quantity")
