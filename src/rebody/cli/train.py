"""`rebody train`: every shipped artifact is made by these commands."""

from dataclasses import dataclass, field, make_dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console

from rebody.bodies import load_robot
from rebody.errors import RebodyError
from rebody.ranges import Seed
from rebody.training.classifier import ClassifierConfig, train_classifier
from rebody.training.flat import FlatConfig, train_flat
from rebody.training.high_level import HighLevelConfig, train_high_level
from rebody.training.inference import PRESETS, MetaConfig, train_inference
from rebody.training.scratch import ScratchConfig, train_scratch
from rebody.training.step_predictor import StepPredictorConfig, train_step_predictor
from rebody.training.tracker import TrackerConfig, tracker_preset, train_tracker

USUAL_ROBOT = "cheetah"
"""Whose settings the help shows where no robot is named."""


@dataclass(frozen=True)
class TrainInference:
    """Train an inference module and the toy's high-level policy on a point mass."""

    config: Annotated[MetaConfig, tyro.conf.arg(name="")]
    out: Path = tyro.MISSING
    """Folder of the run, and of the artifact that it becomes."""
    preset: str = "position"
    """Settings to start from (see `rebody list`); any of them can be changed below."""
    seed: Seed = 0
    """Seed of everything that is random."""
    resume: bool = False
    """Go on with the run in --out; what is still to come of its iterations may change."""
    finish: bool = False
    """With --resume: end the run as it stands, and make an artifact of what was done."""
    init_from: str | None = None
    """Start from the networks of this inference artifact."""

    def run(self) -> None:
        """Train, save, say where."""
        title = f"Inference: {self.preset}"
        folder = train_inference(
            self.config, self.out, self.seed, title=title,
            resume=self.resume, finish=self.finish, init_from=self.init_from,
        )  # fmt: skip
        _show_card(folder)


@dataclass(frozen=True)
class TrainTracker:
    """Train the tracker of a robot: (joint state, subgoal) -> joint action."""

    config: Annotated[TrackerConfig, tyro.conf.arg(name="")]
    out: Path = tyro.MISSING
    """Folder of the run, and of the artifact that it becomes."""
    robot: str = tyro.MISSING
    """A robot's name (see `rebody list`), or the path of its TOML file."""
    seed: Seed = 0
    """Seed of everything that is random."""
    resume: bool = False
    """Go on with the run in --out; what is still to come of its iterations may change."""
    finish: bool = False
    """With --resume: end the run as it stands, and make an artifact of what was done."""
    init_from: str | None = None
    """Start from the network of this tracker artifact."""

    def run(self) -> None:
        """Train, save, say where."""
        folder = train_tracker(
            self.robot, self.config, self.out, self.seed,
            resume=self.resume, finish=self.finish, init_from=self.init_from,
        )  # fmt: skip
        _show_card(folder)


@dataclass(frozen=True)
class TrainFlat:
    """Train a policy without hierarchy on a robot, on the beliefs of a frozen module (thesis 6.3.2)."""

    robot: str
    """Name of the robot (see `rebody list`)."""
    out: Path
    """Folder of the run, and of the artifact that it becomes."""
    inference: str = "position"
    """Inference artifact: a shipped name or a folder."""
    seed: Seed = 0
    """Seed of everything that is random."""
    resume: bool = False
    """Go on with the run in --out; what is still to come of its iterations may change."""
    finish: bool = False
    """With --resume: end the run as it stands, and make an artifact of what was done."""
    init_from: str | None = None
    """Start from the network of this flat artifact."""
    config: Annotated[FlatConfig, tyro.conf.arg(name="")] = field(default_factory=FlatConfig)

    def run(self) -> None:
        """Train, save, say where."""
        folder = train_flat(
            self.robot, self.inference, self.config, self.out, self.seed,
            resume=self.resume, finish=self.finish, init_from=self.init_from,
        )  # fmt: skip
        _show_card(folder)


@dataclass(frozen=True)
class TrainScratch:
    """Train inference module and joint policy together on a robot, nothing reused: what reuse is compared with."""

    robot: str
    """A robot's name (see `rebody list`), or the path of its TOML file."""
    out: Path
    """Folder of the run, and of the artifact that it becomes."""
    seed: Seed = 0
    """Seed of everything that is random."""
    resume: bool = False
    """Go on with the run in --out; what is still to come of its iterations may change."""
    finish: bool = False
    """With --resume: end the run as it stands, and make an artifact of what was done."""
    init_from: str | None = None
    """Start from the networks of this scratch artifact."""
    config: Annotated[ScratchConfig, tyro.conf.arg(name="")] = field(default_factory=ScratchConfig)

    def run(self) -> None:
        """Train, save, say where."""
        folder = train_scratch(
            self.robot, self.config, self.out, self.seed,
            resume=self.resume, finish=self.finish, init_from=self.init_from,
        )  # fmt: skip
        _show_card(folder)


@dataclass(frozen=True)
class TrainHighLevel:
    """Train a high-level policy on a robot, above its frozen tracker, on a frozen module's beliefs (thesis 6.5)."""

    robot: str
    """A robot's name (see `rebody list`), or the path of its TOML file."""
    out: Path
    """Folder of the run, and of the artifact that it becomes."""
    inference: str = "goal-velocity"
    """Inference artifact: a shipped name or a folder."""
    tracker: str | None = None
    """Tracker artifact; default tracker-ROBOT."""
    seed: Seed = 0
    """Seed of everything that is random."""
    resume: bool = False
    """Go on with the run in --out; what is still to come of its iterations may change."""
    finish: bool = False
    """With --resume: end the run as it stands, and make an artifact of what was done."""
    init_from: str | None = None
    """Start from the network of this high-level artifact."""
    config: Annotated[HighLevelConfig, tyro.conf.arg(name="")] = field(default_factory=HighLevelConfig)

    def run(self) -> None:
        """Train, save, say where."""
        folder = train_high_level(
            self.robot, self.inference, self.tracker, self.config, self.out, self.seed,
            resume=self.resume, finish=self.finish, init_from=self.init_from,
        )  # fmt: skip
        _show_card(folder)


@dataclass(frozen=True)
class TrainStepPredictor:
    """Train what says how many control steps a subgoal will take a robot and its frozen tracker (thesis 6.4.3)."""

    robot: str
    """A robot's name (see `rebody list`), or the path of its TOML file."""
    out: Path
    """Folder of the run, and of the artifact that it becomes."""
    tracker: str | None = None
    """Tracker artifact; default tracker-ROBOT."""
    seed: Seed = 0
    """Seed of everything that is random."""
    resume: bool = False
    """Go on with the run in --out; what is still to come of its iterations may change."""
    finish: bool = False
    """With --resume: end the run as it stands, and make an artifact of what was done."""
    init_from: str | None = None
    """Start from the network of this step predictor."""
    config: Annotated[StepPredictorConfig, tyro.conf.arg(name="")] = field(default_factory=StepPredictorConfig)

    def run(self) -> None:
        """Train, save, say where."""
        folder = train_step_predictor(
            self.robot, self.tracker, self.config, self.out, self.seed,
            resume=self.resume, finish=self.finish, init_from=self.init_from,
        )  # fmt: skip
        _show_card(folder)


@dataclass(frozen=True)
class TrainClassifier:
    """Train what chooses a tracker's slot from a belief; everything happens on the toy (thesis 6.4)."""

    out: Path
    """Folder of the run, and of the artifact that it becomes."""
    inference: str = "goal-velocity"
    """Inference artifact: a shipped name or a folder."""
    seed: Seed = 0
    """Seed of everything that is random."""
    resume: bool = False
    """Go on with the run in --out; what is still to come of its iterations may change."""
    finish: bool = False
    """With --resume: end the run as it stands, and make an artifact of what was done."""
    config: Annotated[ClassifierConfig, tyro.conf.arg(name="")] = field(default_factory=ClassifierConfig)

    def run(self) -> None:
        """Train, save, say where."""
        _show_card(
            train_classifier(self.inference, self.config, self.out, self.seed, resume=self.resume, finish=self.finish)
        )


def train_command(arguments: list[str]) -> type:
    """The type of `rebody train`, its defaults those of the preset and the robot that the command line names.

    RebodyError if there is no such preset or robot.
    """
    preset = _wanted("--preset", arguments)
    preset = TrainInference.preset if preset is None else preset
    if preset not in PRESETS:
        raise RebodyError(f"unknown preset '{preset}'. Presets are: {', '.join(PRESETS)}.")
    default = TrainInference(config=PRESETS[preset](), preset=preset)
    # made here, since the defaults are known only now
    inference: Any = Annotated[TrainInference, tyro.conf.subcommand("inference", default=default, prefix_name=False)]
    robot = _wanted("--robot", arguments) if "tracker" in arguments else None
    spec = load_robot(robot or USUAL_ROBOT)
    config = tracker_preset(spec)
    on_robot = TrainTracker(config=config, robot=robot) if robot else TrainTracker(config=config)
    tracker: Any = Annotated[TrainTracker, tyro.conf.subcommand("tracker", default=on_robot, prefix_name=False)]
    classifier: Any = Annotated[TrainClassifier, tyro.conf.subcommand("classifier", prefix_name=False)]
    flat: Any = Annotated[TrainFlat, tyro.conf.subcommand("flat", prefix_name=False)]
    scratch: Any = Annotated[TrainScratch, tyro.conf.subcommand("scratch", prefix_name=False)]
    high_level: Any = Annotated[TrainHighLevel, tyro.conf.subcommand("high-level", prefix_name=False)]
    step_predictor: Any = Annotated[TrainStepPredictor, tyro.conf.subcommand("step-predictor", prefix_name=False)]
    parts = inference | tracker | classifier | high_level | flat | scratch | step_predictor
    command: Any = Annotated[parts, tyro.conf.arg(name="")]
    doc = "Train a part; every shipped artifact is made by these commands."
    return make_dataclass("Train", [("command", command)], frozen=True, namespace={"run": _run, "__doc__": doc})


def _run(train: Any) -> None:
    train.command.run()


def _wanted(option: str, arguments: list[str]) -> str | None:
    """What the command line says of an option that others' defaults hang on."""
    for i, argument in enumerate(arguments):
        if argument == option and i + 1 < len(arguments):
            return arguments[i + 1]
        if argument.startswith(f"{option}="):
            return argument.removeprefix(f"{option}=")
    return None


def _show_card(folder: Path) -> None:
    console = Console(soft_wrap=True)  # whole lines, so that it stays Markdown
    console.print((folder / "card.md").read_text(), markup=False, highlight=False)
    console.print(f"artifact: {folder}", markup=False, highlight=False)
