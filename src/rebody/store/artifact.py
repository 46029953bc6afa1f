"""Artifacts: folders that hold a trained part with all that is needed to rebuild, check and explain it."""

import hashlib
import json
import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import safetensors.numpy
from safetensors import SafetensorError

from rebody.errors import RebodyError, unknown
from rebody.store.checkpoint import holds_checkpoint
from rebody.store.files import DATA, TEXT, output_file, read_file, reason
from rebody.store.files import WEIGHTS as LARGEST_WEIGHTS
from rebody.store.folders import STAGE, replace_together, settle
from rebody.store.trees import tree_to_arrays

FORMAT_VERSION, LARGEST_VERSION = 2, 10**6
SHIPPED = Path(__file__).parents[1] / "artifacts"

WEIGHTS, CONFIG, CARD, LOG = "weights.safetensors", "config.json", "card.md", "log.csv"
HASHED = (WEIGHTS, CONFIG, CARD, LOG)
MANIFEST = "manifest.json"  # holds the others' hashes
LONGEST_NAME = 100
"""Characters of a kind or an array's name."""
LIMITS = {WEIGHTS: LARGEST_WEIGHTS, CONFIG: TEXT, CARD: TEXT, LOG: DATA, MANIFEST: TEXT}


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

    `weights` is a pytree or a dict of arrays; `config` must survive JSON. Other files in the folder are kept, links to
    folders are followed.

    Raises:
        RebodyError: a weight is not finite, or the folder cannot be written to, such as on a full disk.
    """
    path = Path(os.path.abspath(path))
    arrays = tree_to_arrays(weights)
    if faulty := _not_finite(arrays):
        raise RebodyError(
            f"{path} is not written: {faulty} would hold values that are not finite. "
            "The training diverged; try a smaller learning rate or another seed."
        )
    if path.exists() and not path.is_dir():
        raise RebodyError(f"{path} is a file; an artifact is a folder. Choose another folder.")
    content = {
        WEIGHTS: safetensors.numpy.save(arrays),
        CONFIG: _to_json(config),
        CARD: card.encode(),
        LOG: log.encode(),
    }
    try:
        os.makedirs(os.path.realpath(path), exist_ok=True)
        recover(path)
        replace_together(path, content | {MANIFEST: _manifest(kind, content)}, commit=MANIFEST)
    except OSError as error:
        raise RebodyError(f"the artifact {path} cannot be written: {reason(error)}.") from error
    return path


def load_artifact(reference: str | Path, kind: str | None = None) -> Artifact:
    """Load a shipped artifact by name, or one from a folder. Without `kind`: of any.

    A `Path` is always a folder, and so is what holds a separator, such as `./position`.

    Raises:
        RebodyError: it is unknown, incomplete, damaged, of another kind or of another format version, or a weight is
            not finite.
    """
    path = _find(reference, kind)
    manifest, content = _read_all(path)
    if kind not in (None, manifest["kind"]):
        raise RebodyError(
            f"{reference} is an artifact of kind {manifest['kind']!r}; one of kind {kind!r} is needed here, such as "
            f"{', '.join(_names_of(kind)) or 'one of your own'}."
        )
    return Artifact(
        name=os.path.basename(os.path.abspath(reference)),
        path=path,
        kind=manifest["kind"],
        config=_parse_object(content[CONFIG], path / CONFIG),
        arrays=_parse_weights(content[WEIGHTS], path / WEIGHTS),
        card=_parse_text(content[CARD], path / CARD),
        log=_parse_text(content[LOG], path / LOG),
    )


def recover(path: Path) -> None:
    """Finish a save that a kill cut short after its commit, or discard one that it cut before.

    RebodyError if something else than files is where an artifact's files go.
    """
    for name in LIMITS:
        output_file(path / name)
    if not (path / STAGE).exists():
        return
    try:
        hashes = _read_manifest(path)["files"]
    except RebodyError:  # none yet, or damaged: nothing tells that what was staged belongs to it
        hashes = {}
    settle(path, [name for name in HASHED if _staged_hash(path, name) == hashes.get(name, "")])


def shipped_artifacts() -> list[tuple[str, str]]:
    """(name, kind) of every artifact inside the package, in the order of their names."""
    folders = sorted(manifest.parent for manifest in SHIPPED.glob(f"*/{MANIFEST}"))
    return [(folder.name, _read_manifest(folder)["kind"]) for folder in folders]


# writing


def _not_finite(arrays: dict[str, np.ndarray]) -> str:
    """Names of the first few arrays that hold values that are not finite."""
    faulty = [name for name, array in arrays.items() if not np.isfinite(array).all()]
    return ", ".join(name[:LONGEST_NAME] for name in faulty[:4])


def _to_json(value: Any) -> bytes:
    return (json.dumps(value, indent=2, allow_nan=False) + "\n").encode()


def _manifest(kind: str, content: dict[str, bytes]) -> bytes:
    files = {name: hashlib.sha256(data).hexdigest() for name, data in content.items()}
    return _to_json({"format_version": FORMAT_VERSION, "kind": kind, "files": files})


def _staged_hash(path: Path, name: str) -> str | None:
    staged = path / STAGE / name
    return hashlib.sha256(staged.read_bytes()).hexdigest() if staged.is_file() else None


# reading


def _find(reference: str | Path, kind: str | None) -> Path:
    """The folder that a shipped name or a path stands for."""
    is_name = isinstance(reference, str) and not {"/", os.sep} & set(reference)
    if is_name and (SHIPPED / reference / MANIFEST).is_file():
        return SHIPPED / reference
    folder = Path(os.path.abspath(reference))
    if folder.is_dir():
        return folder
    what = "artifact" if kind is None else f"{kind} artifact"
    raise unknown(what, reference, _names_of(kind), "or a folder of your own")


def _names_of(kind: str | None) -> list[str]:
    return [name for name, of_kind in shipped_artifacts() if kind in (None, of_kind)]


def _read_all(path: Path) -> tuple[dict[str, Any], dict[str, bytes]]:
    """The manifest and what belongs to it, while another process may be saving."""
    manifest = _read_manifest(path)
    while True:
        try:
            return manifest, {name: _read_hashed(path, name, manifest["files"].get(name)) for name in HASHED}
        except RebodyError:
            before, manifest = manifest, _read_manifest(path)
            if manifest == before:  # else a new artifact took the place of the one that was being read
                raise


def _read_manifest(path: Path) -> dict[str, Any]:
    try:
        manifest = _parse_object(_read(path, MANIFEST), path / MANIFEST)
    except FileNotFoundError:
        raise _missing(path, MANIFEST) from None
    version, kind, files = (manifest.get(key) for key in ("format_version", "kind", "files"))
    is_sound = isinstance(version, int) and abs(version) <= LARGEST_VERSION and isinstance(files, dict)
    if not is_sound or not isinstance(kind, str) or len(kind) > LONGEST_NAME:
        raise _damaged(path / MANIFEST)
    if version != FORMAT_VERSION:
        raise RebodyError(
            f"{path} has format version {version}; this rebody reads version {FORMAT_VERSION}. "
            "Install the version of rebody that made it, or make it anew."
        )
    return manifest


def _read(path: Path, name: str, folder: str = "") -> bytes:
    inside = None if path.parent == SHIPPED else path  # some installers lay out packages as links
    return read_file(path / folder / name, LIMITS[name], inside)


def _read_hashed(path: Path, name: str, sha256: Any) -> bytes:
    """From its place, or from where a save that is going on, or was cut short, has it; by then it may have moved."""
    for folder in ("", STAGE, ""):
        with suppress(FileNotFoundError):
            data = _read(path, name, folder)
            if hashlib.sha256(data).hexdigest() == sha256:
                return data
    raise _damaged(path / name) if (path / name).exists() else _missing(path, name)


def _parse_object(data: bytes, path: Path) -> dict[str, Any]:
    try:
        value = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise _damaged(path) from error
    if not isinstance(value, dict):
        raise _damaged(path)
    return value


def _parse_text(data: bytes, path: Path) -> str:
    try:
        return data.decode()
    except UnicodeDecodeError as error:
        raise _damaged(path) from error


def _parse_weights(data: bytes, path: Path) -> dict[str, np.ndarray]:
    try:
        arrays = safetensors.numpy.load(data)
    except SafetensorError as error:
        raise _damaged(path) from error
    except KeyError as error:
        raise RebodyError(f"{path} holds weights of type {error}, which NumPy lacks. Store them as F32.") from error
    if faulty := _not_finite(arrays):
        raise RebodyError(f"{path} holds values that are not finite, in {faulty}. Copy or make the artifact anew.")
    return arrays


def _missing(path: Path, name: str) -> RebodyError:
    if name == MANIFEST and holds_checkpoint(path):
        return RebodyError(
            f"{path} holds an unfinished run: go on with it by the same command and `--resume`, or make an artifact of "
            "it as it stands with `--resume --finish`."
        )
    return RebodyError(f"{path} is not a complete artifact: {name} is missing. Copy or make it anew.")


def _damaged(path: Path) -> RebodyError:
    return RebodyError(f"{path} is damaged or was edited: it is not what was saved. Copy or make the artifact anew.")
