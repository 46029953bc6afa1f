"""Checkpoints: the whole state of one run in one file, so that a killed run continues where it was.

Everything is in one safetensors file, since one rename is the only change that a crash cannot split.
A hash over meta data and arrays lies in its header: a flipped byte often loads without a word.
"""

import hashlib
import json
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import safetensors.numpy
from safetensors import SafetensorError, safe_open

from rebody.errors import RebodyError
from rebody.store.files import MB, check_file, reason, sync
from rebody.store.trees import arrays_into_tree, tree_hash, tree_to_arrays
from rebody.types import Tree

FORMAT_VERSION = "1"
FOLDER, FILE = "checkpoint", "checkpoint.safetensors"
"""Of a run's folder, and in that one."""
LARGEST = 64_000 * MB
"""It is mapped, not read: this only tells a checkpoint from what cannot be one."""


def save_checkpoint(folder: Path, state: Any, meta: dict[str, Any]) -> None:
    """Replace the folder's checkpoint by `state` (any pytree of arrays) and `meta` (JSON).

    A crash at any moment leaves the old checkpoint or the new one; so does a full disk, which is a RebodyError.
    """
    arrays, meta_json = tree_to_arrays(state), json.dumps(meta)
    header = {"format_version": FORMAT_VERSION, "meta": meta_json, "sha256": _sha256(arrays, meta_json)}
    new = folder / f"{FILE}.new"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        new.unlink(missing_ok=True)
        safetensors.numpy.save_file(arrays, new, metadata=header)
        sync(new)
        os.replace(new, folder / FILE)
        sync(folder)
    except (OSError, SafetensorError) as error:  # of a full disk safetensors says so in its own error
        raise RebodyError(
            f"the checkpoint {folder / FILE} cannot be written: {reason(error)}. Any earlier one is whole: "
            "mend this, then go on with --resume."
        ) from error
    finally:
        with suppress(OSError):
            new.unlink(missing_ok=True)


def holds_checkpoint(out: Path) -> bool:
    """Whether a run's folder has one."""
    return (out / FOLDER / FILE).exists()


def load_checkpoint(
    folder: Path, template: Tree, check: Callable[[dict[str, Any]], None] = lambda meta: None
) -> tuple[Tree, dict[str, Any]] | None:
    """The saved (state, meta), the state shaped like `template`; None if the folder has no checkpoint.

    `check` sees the meta data first: it can say more plainly than shapes why something does not fit.

    Raises:
        RebodyError: it is damaged, of another format version, or does not fit the template.
    """
    path = folder / FILE
    if not path.exists():
        return None
    arrays, meta = _read_checked(path)
    check(meta)
    return arrays_into_tree(template, arrays, f"checkpoint {path}"), meta


def read_meta(folder: Path) -> dict[str, Any] | None:
    """What was saved beside the state; None if the folder has no checkpoint.

    Raises:
        RebodyError: it is damaged, or of another format version.
    """
    path = folder / FILE
    return _read_checked(path)[1] if path.exists() else None


def _read_checked(path: Path) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    header, arrays = _read(path)
    if header.get("format_version") != FORMAT_VERSION:
        raise RebodyError(
            f"{path} was not written by this version of rebody. "
            "Continue with the version that began the run, or start in another folder."
        )
    meta_json = header.get("meta", "")
    try:
        if header.get("sha256") == _sha256(arrays, meta_json) and isinstance(meta := json.loads(meta_json), dict):
            return arrays, meta
    except (ValueError, RecursionError, TypeError) as error:  # the last for types that are never stored
        raise _damaged(path) from error
    raise _damaged(path)


def _sha256(arrays: dict[str, np.ndarray], meta_json: str) -> str:
    return hashlib.sha256((tree_hash(arrays) + meta_json).encode()).hexdigest()


def _read(path: Path) -> tuple[dict[str, str], dict[str, np.ndarray]]:
    check_file(path, LARGEST, inside=path.parent)
    try:
        with safe_open(path, framework="np") as file:
            return file.metadata() or {}, file.get_tensors()
    except (SafetensorError, TypeError, AttributeError) as error:  # the latter two for types that NumPy lacks
        raise _damaged(path) from error


def _damaged(path: Path) -> RebodyError:
    return RebodyError(
        f"{path} is damaged: it is not what was saved. Delete it to start anew, or restore it from a copy."
    )
