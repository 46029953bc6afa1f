"""Files that last: artifacts (trained parts, shared) and checkpoints (runs, continued)."""

from rebody.store.artifact import Artifact, load_artifact, recover, save_artifact, shipped_artifacts
from rebody.store.checkpoint import holds_checkpoint, load_checkpoint, read_meta, save_checkpoint
from rebody.store.folders import take_folder
from rebody.store.trees import arrays_into_tree, tree_hash, tree_to_arrays

__all__ = [
    "Artifact",
    "arrays_into_tree",
    "holds_checkpoint",
    "load_artifact",
    "load_checkpoint",
    "read_meta",
    "recover",
    "save_artifact",
    "save_checkpoint",
    "shipped_artifacts",
    "take_folder",
    "tree_hash",
    "tree_to_arrays",
]
