"""Artifacts: folders that hold a trained part with all that is needed to rebuild, check and explain it."""

import difflib
import hashlib
import json
import os
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import safetensors.numpy
from safetensors import SafetensorError

from rebody.errors import RebodyError
from rebody.store.files import sync
from rebody.store.trees import tree_to_arrays

FORMAT_VERSION = 1
SHIPPED = Path(__file__).parents[1] / "artifacts"

WEIGHTS, CONFIG, CARD, LOG = "weights.safetensors", "config.json", "card.md", "log.csv"
HASHED = (WEIGHTS, CONFIG, CARD, LOG)
MANIFEST = "manifest.json"  # holds the others' hashes


@dataclass(frozen=True)
class Artifact:
    """One loaded artifact, its hashes checked."""

    name: str  # of its folder
    path: Path
    kind: str  # such as "inference", "tracker"
    config: dict[str, Any]  # all that rebuilds the object, contract included
    arrays: dict[str, np.ndarray]  # weights by dotted name: see `arrays_into_tree`
    card: str  # Markdown: what it is and how it was made
    log: str  # CSV: what training measured, a row per iteration


def save_artifact(path: Path, *, kind: str, config: dict[str, Any], weights: Any, card: str, log: str) -> Path:
    """Write an artifact into the folder `path`; an older artifact there stays readable until the end.

    `weights` is a pytree or a dict of arrays; `config` must survive JSON. Other files in the folder are kept.

    Raises:
        RebodyError: a weight is not finite, or `path` is a file.
    """
    path = Path(os.path.abspath(path))
    arrays = tree_to_arrays(weights)
    _refuse_non_finite(arrays, path)
    if path.exists() and not path.is_dir():
        raise RebodyError(f"{path} is a file; an artifact is a folder. Choose another folder.")
    content = {
        WEIGHTS: safetensors.numpy.save(arrays),
        CONFIG: _to_json(config),
        CARD: card.encode(),
        LOG: log.encode(),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    new = path.with_name(f".{path.name}.new")
    try:
        _write_folder(new, content | {MANIFEST: _manifest(kind, content)})
        _replace_folder(path, new)
    finally:
        shutil.rmtree(new, ignore_errors=True)
    return path


def load_artifact(reference: str | Path, kind: str | None = None) -> Artifact:
    """Load a shipped artifact by name, or one from a folder; a `Path` is always a folder. Without `kind`: of any.

    Raises:
        RebodyError: it is unknown, incomplete, damaged, of another kind or of another format version.
    """
    path = _find(reference, kind)
    manifest = _read_manifest(path)
    if kind not in (None, manifest["kind"]):
        raise RebodyError(
            f"{reference} is an artifact of kind {manifest['kind']!r}; one of kind {kind!r} is needed here. "
            + _shipped_of(kind)
        )
    content = {name: _read_hashed(path / name, manifest["files"].get(name)) for name in HASHED}
    return Artifact(
        name=os.path.basename(os.path.abspath(reference)),
        path=path,
        kind=manifest["kind"],
        config=_parse_object(content[CONFIG], path / CONFIG),
        arrays=_parse_weights(content[WEIGHTS], path / WEIGHTS),
        card=content[CARD].decode(),
        log=content[LOG].decode(),
    )


def recover(path: Path) -> None:
    """Put a folder back in its place that a save was about to replace when it was killed."""
    if not path.exists() and _backup(path).is_dir():
        _backup(path).rename(path)


def shipped_artifacts() -> list[tuple[str, str]]:
    """(name, kind) of every artifact inside the package, in the order of their names."""
    folders = sorted(manifest.parent for manifest in SHIPPED.glob(f"*/{MANIFEST}"))
    return [(folder.name, _read_manifest(folder)["kind"]) for folder in folders]


# writing


def _refuse_non_finite(arrays: dict[str, np.ndarray], path: Path) -> None:
    faulty = [name for name, array in arrays.items() if not np.isfinite(array).all()]
    if faulty:
        raise RebodyError(
            f"{path} is not written: {', '.join(faulty[:4])} would hold values that are not finite. "
            "The training diverged; try a smaller learning rate or another seed."
        )


def _to_json(value: Any) -> bytes:
    return (json.dumps(value, indent=2, allow_nan=False) + "\n").encode()


def _manifest(kind: str, content: dict[str, bytes]) -> bytes:
    files = {name: hashlib.sha256(data).hexdigest() for name, data in content.items()}
    return _to_json({"format_version": FORMAT_VERSION, "kind": kind, "files": files})


def _write_folder(folder: Path, content: dict[str, bytes]) -> None:
    shutil.rmtree(folder, ignore_errors=True)  # left by a process that was killed
    folder.mkdir()
    for name, data in content.items():
        (folder / name).write_bytes(data)
        sync(folder / name)
    sync(folder)


def _backup(path: Path) -> Path:
    return path.with_name(f".{path.name}.old")


def _replace_folder(path: Path, new: Path) -> None:
    """A full folder cannot be renamed over another: the old one steps aside, and back if anything fails."""
    backup = _backup(path)
    _retire(backup, path)
    if path.exists():
        os.rename(path, backup)
    try:
        os.rename(new, path)
    except BaseException:
        if backup.exists():
            backup.rename(path)
        raise
    sync(path.parent)
    _retire(backup, path)


def _retire(backup: Path, path: Path) -> None:
    """Remove the older artifact once `path` holds one; what is not part of it moves over to `path`."""
    if not backup.exists():
        return
    if not path.exists():  # killed between the two renames
        backup.rename(path)
        return
    for entry in backup.iterdir():
        if entry.name not in (*HASHED, MANIFEST):
            entry.rename(path / entry.name)
    shutil.rmtree(backup)
    sync(path.parent)


# reading


def _find(reference: str | Path, kind: str | None) -> Path:
    """The folder that a shipped name or a path stands for."""
    if isinstance(reference, str) and (SHIPPED / reference / MANIFEST).is_file():
        return SHIPPED / reference
    folder = Path(os.path.abspath(reference))
    if folder.is_dir():
        return folder
    if _backup(folder).is_dir():  # a save was killed between its two renames
        return _backup(folder)
    raise RebodyError(_unknown(str(reference), kind))


def _unknown(reference: str, kind: str | None) -> str:
    close = difflib.get_close_matches(reference, _names_of(kind), n=1)
    guess = f" Did you mean {close[0]!r}?" if close else ""
    return f"no artifact or folder called {reference!r}.{guess} {_shipped_of(kind)}"


def _names_of(kind: str | None) -> list[str]:
    return [name for name, of_kind in shipped_artifacts() if kind in (None, of_kind)]


def _shipped_of(kind: str | None) -> str:
    names = ", ".join(_names_of(kind)) or "none"
    of_kind = "" if kind is None else f" of kind {kind!r}"
    return f"Shipped artifacts{of_kind}: {names}. Give one of these, or a folder of your own."


def _read_manifest(path: Path) -> dict[str, Any]:
    manifest = _parse_object(_read(path / MANIFEST), path / MANIFEST)
    version, kind, files = (manifest.get(key) for key in ("format_version", "kind", "files"))
    if version is None or not isinstance(kind, str) or not isinstance(files, dict):
        raise _damaged(path / MANIFEST)
    if version != FORMAT_VERSION:
        raise RebodyError(
            f"{path} has format version {version}; this rebody reads version {FORMAT_VERSION}. "
            "Install the version of rebody that made it, or make it anew."
        )
    return manifest


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise RebodyError(
            f"{path.parent} is not a complete artifact: {path.name} is missing. Copy or make it anew."
        ) from None


def _read_hashed(path: Path, sha256: Any) -> bytes:
    data = _read(path)
    if hashlib.sha256(data).hexdigest() != sha256:
        raise _damaged(path)
    return data


def _parse_object(data: bytes, path: Path) -> dict[str, Any]:
    try:
        value = json.loads(data)
    except ValueError as error:
        raise _damaged(path) from error
    if not isinstance(value, dict):
        raise _damaged(path)
    return value


def _parse_weights(data: bytes, path: Path) -> dict[str, np.ndarray]:
    try:
        return safetensors.numpy.load(data)
    except SafetensorError as error:
        raise _damaged(path) from error


def _damaged(path: Path) -> RebodyError:
    return RebodyError(f"{path} is damaged or was edited: it is not what was saved. Copy or make the artifact anew.")
