"""Training logs that figures are drawn from: of shipped artifacts, or of the same trainings anew."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from rebody.bodies import load_robot
from rebody.report.thesis.data import Data, join
from rebody.store import load_artifact
from rebody.training.flat import FlatConfig, train_flat
from rebody.training.high_level import HighLevelConfig, train_high_level
from rebody.training.inference import PRESETS, train_inference
from rebody.training.run import read_log
from rebody.training.tracker import tracker_preset, train_tracker

OLD_NAMES = {f"evaluation/{name} error": f"evaluation/goal {name}" for name in ("median", "p95")}
"""What older logs of flat policies call errors."""


def training_log(artifact: str | Path) -> Data:
    """What the training of an artifact measured: an array per column, NaN where it measured nothing.

    `steps` counts steps of the toy or control steps of the robots.
    """
    loaded = load_artifact(artifact)
    data = {OLD_NAMES.get(name, name): column.astype(np.float32) for name, column in read_log(loaded.log).items()}
    settings = loaded.config["training"]
    sizes = ("episodes", "decisions") if loaded.kind == "inference" else ("robots", "steps")
    return data | {"steps": data["iteration"] * np.prod([settings[size] for size in sizes])}


def logs_of(artifacts: Sequence[str], log_of: Callable[[str], Data] = training_log) -> Data:
    """The log of one artifact, or those of several as one."""
    return log_of(artifacts[0]) if len(artifacts) == 1 else join({name: log_of(name) for name in artifacts})


def train_again(artifact: str, runs: Path) -> Data:
    """The log of a shipped artifact's training with its preset, in a folder of its name; a run there goes on."""
    kind, out = load_artifact(artifact).kind, runs / artifact
    module, _, robot = artifact.removeprefix(f"{kind}-").rpartition("-")
    match kind:
        case "inference":
            train_inference(PRESETS[artifact](), out, 0, title=f"Inference: {artifact}", resume=True)
        case "tracker":
            train_tracker(robot, tracker_preset(load_robot(robot)), out, 0, resume=True)
        case "flat":
            train_flat(robot, module, FlatConfig(), out, 0, resume=True)
        case "high-level":
            train_high_level(robot, module, None, HighLevelConfig(), out, 0, resume=True)
    return training_log(out)
