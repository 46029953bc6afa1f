"""`rebody train`: every shipped artifact is made by these commands."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console

from rebody.errors import RebodyError
from rebody.training.inference import PRESETS, MetaConfig, train_inference
from rebody.training.tracker import TrackerConfig, train_tracker


@dataclass(frozen=True)
class TrainInference:
    """Train an inference module and the toy's high-level policy on a point mass."""

    config: Annotated[MetaConfig, tyro.conf.arg(name="")]
    out: Path = tyro.MISSING
    """Folder of the run, and of the artifact that it becomes."""
    preset: str = "position"
    """Settings to start from (see `rebody list`); any of them can be changed below."""
    seed: int = 0
    """Seed of everything that is random."""
    resume: bool = False
    """Go on with the run in --out."""
    init_from: str | None = None
    """Start from the networks of this inference artifact."""

    def run(self) -> None:
        """Train, save, say where."""
        title = f"Inference: {self.preset}"
        folder = train_inference(
            self.config, self.out, self.seed, title=title, resume=self.resume, init_from=self.init_from
        )
        _show_card(folder)


@dataclass(frozen=True)
class TrainTracker:
    """Train the tracker of a robot: (joint state, subgoal) -> joint action."""

    robot: str
    """Name of the robot (see `rebody list`)."""
    out: Path
    """Folder of the run, and of the artifact that it becomes."""
    seed: int = 0
    """Seed of everything that is random."""
    resume: bool = False
    """Go on with the run in --out."""
    init_from: str | None = None
    """Start from the network of this tracker artifact."""
    config: Annotated[TrackerConfig, tyro.conf.arg(name="")] = field(default_factory=TrackerConfig)

    def run(self) -> None:
        """Train, save, say where."""
        folder = train_tracker(
            self.robot, self.config, self.out, self.seed, resume=self.resume, init_from=self.init_from
        )
        _show_card(folder)


def train_inference_default(arguments: list[str]) -> TrainInference:
    """Defaults of the preset that a command line names; RebodyError if there is none of that name."""
    name = TrainInference.preset
    for i, argument in enumerate(arguments):
        if argument == "--preset" and i + 1 < len(arguments):
            name = arguments[i + 1]
        elif argument.startswith("--preset="):
            name = argument.removeprefix("--preset=")
    if name not in PRESETS:
        raise RebodyError(f"unknown preset '{name}'. Presets are: {', '.join(PRESETS)}.")
    return TrainInference(config=PRESETS[name](), preset=name)


def _show_card(folder: Path) -> None:
    console = Console()
    console.print((folder / "card.md").read_text(), markup=False, highlight=False)
    console.print(f"artifact: {folder}", markup=False, highlight=False)
