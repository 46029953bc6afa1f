"""What the things on the command line stand for."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rebody.errors import RebodyError
from rebody.evaluation.reading import holds_results, read_results
from rebody.evaluation.results import Results
from rebody.report.page import log as log_file
from rebody.report.page.log import Log
from rebody.store import load_artifact, read_meta, shipped_artifacts
from rebody.store.artifact import HASHED, MANIFEST, WEIGHTS
from rebody.store.checkpoint import FOLDER
from rebody.store.files import DATA, check_file

PICTURES, VIDEOS = (".png", ".svg"), (".mp4",)
EXPECTED = (
    "Give the folder of a training run or of an artifact, the name of a shipped artifact (rebody list), a JSON that "
    "`rebody evaluate --json` wrote, or a folder that holds such JSONs, figures (.png, .svg) or videos (.mp4)."
)


@dataclass(frozen=True)
class Training:
    """A run, finished or not."""

    kind: str
    """Of the artifact that it made, such as tracker."""
    settings: dict[str, Any]
    card: str | None
    """Markdown; None as long as the run is not finished."""
    log: Log
    notes: list[str]
    """What of it cannot be shown."""

    @property
    def iterations(self) -> int:
        """How many are done."""
        return len(next(iter(self.log.values()), ()))


@dataclass(frozen=True)
class Found:
    """What one thing on the command line holds."""

    name: str
    place: str
    training: Training | None
    results: dict[Path, Results]
    """By their file."""
    pictures: list[Path]
    videos: list[Path]
    skipped: list[str]
    """JSONs that hold no results."""


def find(reference: str) -> Found:
    """What there is to show of a run, an artifact, a JSON or a folder; RebodyError if that is nothing."""
    path = Path(reference)
    if reference in dict(shipped_artifacts()):
        shipped = load_artifact(reference)
        return Found(reference, "shipped with rebody", _training(shipped.path), {}, [], [], [])
    if path.is_dir():
        return _in_folder(path)
    if path.exists():
        if not holds_results(path):
            raise RebodyError(f"{path} holds no results of an evaluation. {EXPECTED}")
        return Found(path.name, reference, None, {path: read_results(path)}, [], [], [])
    raise RebodyError(f"there is no '{reference}'. {EXPECTED}")


def _in_folder(folder: Path) -> Found:
    files = sorted(path for path in folder.iterdir() if path.is_file() and not path.name.startswith("."))
    jsons = [path for path in files if path.suffix == ".json" and path.name not in (*HASHED, MANIFEST)]
    results = {path: read_results(path, folder) for path in jsons if holds_results(path, folder)}
    pictures, videos = ([path for path in files if path.suffix.lower() in kind] for kind in (PICTURES, VIDEOS))
    for path in (*pictures, *videos):
        check_file(path, DATA, folder)
    found = Found(
        name=folder.resolve().name,
        place=str(folder),
        training=_training(folder),
        results=results,
        pictures=pictures,
        videos=videos,
        skipped=[path.name for path in jsons if path not in results],
    )
    if not (found.training or found.results or found.pictures or found.videos):
        raise RebodyError(f"the folder {folder} holds nothing to report. {EXPECTED}")
    return found


def _training(folder: Path) -> Training | None:
    """The artifact that a run left behind, else what its last checkpoint says of it."""
    if (folder / MANIFEST).exists() or (folder / WEIGHTS).exists():
        artifact = load_artifact(folder)
        log, notes = log_file.read_csv(artifact.log)
        return Training(artifact.kind, artifact.config, artifact.card, log, notes)
    meta = read_meta(folder / FOLDER)
    if meta is None:
        return None
    settings, log, notes = log_file.read_meta(meta)
    return Training("not finished", settings, None, log, notes)
