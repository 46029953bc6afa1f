"""`rebody train`: every shipped artifact is made by these commands."""

from collections.abc import Sequence
from dataclasses import dataclass, field, make_dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console

from rebody.bodies import load_robot, shipped_robots
from rebody.cli.commands import subcommands
from rebody.control.command import commands_within
from rebody.errors import RebodyError, unknown
from rebody.names import presets
from rebody.ranges import Seed, interval
from rebody.tasks import SHIPPED, FamilySet
from rebody.tasks.family_file import read_families
from rebody.training.classifier import ClassifierConfig, train_classifier
from rebody.training.flat import FlatConfig, train_flat
from rebody.training.high_level import HighLevelConfig, train_high_level
from rebody.training.inference import PRESETS, MetaConfig, train_inference
from rebody.training.navigator import NavigatorConfig, train_navigator
from rebody.training.scratch import ScratchConfig, train_scratch
from rebody.training.step_predictor import StepPredictorConfig, train_step_predictor
from rebody.training.tracker import TrackerConfig, tracker_preset, train_tracker
from rebody.training.walking import WalkingConfig, train_walking

FLAT = tyro.conf.arg(name="")
"""Settings whose options have no prefix."""
Named = tyro.conf.Suppress[tyro.conf.Fixed[str]]
"""No option: the subcommand's name says it."""


@dataclass(frozen=True)
class RunOptions:
    """Options that all trainings share."""

    out: Path = tyro.MISSING
    """Folder of the run, and of the artifact that it becomes."""
    seed: Seed = 0
    """Seed of everything that is random."""
    resume: bool = False
    """Go on with the run in --out; what is still to come of its iterations may change."""
    finish: bool = False
    """With --resume: end the run as it stands, and make an artifact of what was done."""


@dataclass(frozen=True)
class StartOptions(RunOptions):
    """Options of a training that can start from an artifact."""

    init_from: str | None = None
    """Start from the networks of this artifact, which the same command made."""


Run = Annotated[RunOptions, FLAT]
Start = Annotated[StartOptions, FLAT]


@dataclass(frozen=True)
class TrainInference:
    """Train an inference module and the toy's high-level policy on a point mass."""

    preset: Named
    config: Annotated[MetaConfig, FLAT]
    options: Start = field(default_factory=StartOptions)

    def run(self) -> None:
        """Train, save, say where."""
        _show_card(train_inference(self.config, title=f"Inference: {self.preset}", **vars(self.options)))


@dataclass(frozen=True)
class TrainTracker:
    """Train the tracker of a robot: (joint state, subgoal) -> joint action."""

    robot: Named
    config: Annotated[TrackerConfig, FLAT]
    reach: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Ranges of families of one number, beside those of the robot's file or in their place: jump 0.5 3.0."""
    options: Start = field(default_factory=StartOptions)

    def run(self) -> None:
        """Train, save, say where; families of a file are asked of the robot as far as its reach names them."""
        own = {name: interval(*ends) for name, ends in self.reach.items()}
        reach = tuple((dict(load_robot(self.robot).reach) | own).items())
        families = commands_within(reach, self.config.families.beside(SHIPPED))
        _show_card(train_tracker(self.robot, replace(self.config, families=families), **vars(self.options)))


@dataclass(frozen=True)
class TrainWalking:
    """Train the walking policy of a robot that is to follow a joystick: (what it feels, command) -> joint targets."""

    robot: Named
    config: Annotated[WalkingConfig, FLAT] = field(default_factory=WalkingConfig)
    options: Start = field(default_factory=StartOptions)

    def run(self) -> None:
        """Train, save, say where."""
        _show_card(train_walking(self.robot, self.config, **vars(self.options)))


@dataclass(frozen=True)
class TrainFlat:
    """Train a policy without hierarchy on a robot, on the beliefs of a frozen module (thesis 6.3.2)."""

    robot: str
    """A robot's name (see `rebody list`), or the path of its TOML file."""
    inference: str = "position"
    """Inference artifact: a shipped name or a folder."""
    families: Path | None = None
    """File of your own families, where the module knows any with a reward law of your own."""
    options: Start = field(default_factory=StartOptions)
    config: Annotated[FlatConfig, FLAT] = field(default_factory=FlatConfig)

    def run(self) -> None:
        """Train, save, say where."""
        read_families(self.families)  # artifacts may name its laws
        _show_card(train_flat(self.robot, self.inference, self.config, **vars(self.options)))


@dataclass(frozen=True)
class TrainScratch:
    """Train inference module and joint policy together on a robot, nothing reused: what reuse is compared with."""

    robot: str
    """A robot's name (see `rebody list`), or the path of its TOML file."""
    options: Start = field(default_factory=StartOptions)
    config: Annotated[ScratchConfig, FLAT] = field(default_factory=ScratchConfig)

    def run(self) -> None:
        """Train, save, say where."""
        _show_card(train_scratch(self.robot, self.config, **vars(self.options)))


@dataclass(frozen=True)
class TrainHighLevel:
    """Train a high-level policy on a robot, above its frozen tracker, on a frozen module's beliefs (thesis 6.5)."""

    robot: str
    """A robot's name (see `rebody list`), or the path of its TOML file."""
    inference: str = "goal-velocity"
    """Inference artifact: a shipped name or a folder."""
    tracker: str | None = None
    """Tracker artifact; default tracker-ROBOT."""
    families: Path | None = None
    """File of your own families, where the module knows any with a reward law of your own."""
    options: Start = field(default_factory=StartOptions)
    config: Annotated[HighLevelConfig, FLAT] = field(default_factory=HighLevelConfig)

    def run(self) -> None:
        """Train, save, say where."""
        read_families(self.families)  # artifacts may name its laws
        _show_card(train_high_level(self.robot, self.inference, self.tracker, self.config, **vars(self.options)))


@dataclass(frozen=True)
class TrainStepPredictor:
    """Train what says how many control steps a subgoal will take a robot and its frozen tracker (thesis 6.4.3)."""

    robot: str
    """A robot's name (see `rebody list`), or the path of its TOML file."""
    tracker: str | None = None
    """Tracker artifact; default tracker-ROBOT."""
    families: Path | None = None
    """File of your own families, where the tracker knows any with a reward law of your own."""
    options: Start = field(default_factory=StartOptions)
    config: Annotated[StepPredictorConfig, FLAT] = field(default_factory=StepPredictorConfig)

    def run(self) -> None:
        """Train, save, say where."""
        read_families(self.families)  # artifacts may name its laws
        _show_card(train_step_predictor(self.robot, self.tracker, self.config, **vars(self.options)))


@dataclass(frozen=True)
class TrainClassifier:
    """Train what chooses a tracker's slot from a belief; everything happens on the toy (thesis 6.4)."""

    inference: str = "goal-velocity"
    """Inference artifact: a shipped name or a folder."""
    families: Path | None = None
    """File of your own families, where the module knows any with a reward law of your own."""
    options: Run = field(default_factory=RunOptions)
    config: Annotated[ClassifierConfig, FLAT] = field(default_factory=ClassifierConfig)

    def run(self) -> None:
        """Train, save, say where."""
        read_families(self.families)  # artifacts may name its laws
        _show_card(train_classifier(self.inference, self.config, **vars(self.options)))


@dataclass(frozen=True)
class TrainNavigator:
    """Train what turns subgoals into joystick commands, for robots that walk by a policy of their own; everything
    happens on a joystick toy."""

    options: Run = field(default_factory=RunOptions)
    config: Annotated[NavigatorConfig, FLAT] = field(default_factory=NavigatorConfig)

    def run(self) -> None:
        """Train, save, say where."""
        _show_card(train_navigator(self.config, **vars(self.options)))


def train_command(arguments: Sequence[str]) -> type:
    """Train a part; every shipped artifact is made by these commands."""
    robots = {name: f"The tracker of the {name}." for name in shipped_robots()}
    preset = _word_behind("inference", "PRESET", presets(), arguments)
    if preset is not None and preset not in PRESETS:
        raise unknown("preset", preset, PRESETS)
    # a robot of the user's own is a subcommand, too: its path is the only argument that is read before tyro reads all
    own = _word_behind(
        "tracker", "ROBOT", robots | {"PATH": "The tracker of your own robot, by its TOML file."}, arguments
    )
    robots |= {} if own is None or own in robots else {own: "The tracker of your own robot."}
    of_preset = {name: TrainInference(name, preset()) for name, preset in PRESETS.items()}
    known = read_families(_value_of("--families", arguments))
    of_robot = {name: _tracker_of(name, known) for name in robots}
    parts = {
        "inference": _one_of(of_preset, TrainInference.__doc__, presets()),
        "tracker": _one_of(of_robot, f"{TrainTracker.__doc__} Your own: the path of its TOML file.", robots),
        "classifier": TrainClassifier,
        "navigator": TrainNavigator,
        "high-level": TrainHighLevel,
        "flat": TrainFlat,
        "scratch": TrainScratch,
        "step-predictor": TrainStepPredictor,
    }
    return _one_of(parts, train_command.__doc__)


def _tracker_of(robot: str, known: FamilySet) -> TrainTracker | TrainWalking:
    """What is trained for a robot: that it follows a joystick, or subgoals."""
    spec = load_robot(robot)
    return TrainTracker(robot, tracker_preset(spec, known)) if spec.walking is None else TrainWalking(robot)


def _one_of(kinds: dict[str, Any], doc: str | None, lines: dict[str, str] | None = None) -> type:
    """A command that is one of several subcommands."""
    command = Annotated[subcommands(kinds, lines or {}), FLAT]
    namespace = {"run": lambda self: self.command.run(), "__doc__": doc}
    return make_dataclass("Train", [("command", command)], frozen=True, namespace=namespace)


def _word_behind(part: str, what: str, known: dict[str, str], arguments: Sequence[str]) -> str | None:
    """What follows `train PART`, if that is the command; RebodyError with all that could, where nothing does."""
    word = next(iter(arguments[2:]), "")
    if list(arguments[:2]) != ["train", part] or word in ("-h", "--help"):
        return None
    if len(arguments) < 3 or word.startswith("-"):
        lines = "".join(f"\n  {name}: {line}" for name, line in known.items())
        raise RebodyError(f"write `rebody train {part} {what} --out DIR`, where {what} is one of{lines}")
    return word


def _value_of(option: str, arguments: Sequence[str]) -> Path | None:
    """What is behind an option, or behind its equals sign, that is read before tyro reads all."""
    words = [word for each in arguments for word in (each.split("=", 1) if each.startswith(option) else [each])]
    behind = words[words.index(option) + 1 :] if option in words else []
    return Path(behind[0]) if behind else None


def _show_card(folder: Path) -> None:
    console = Console(soft_wrap=True)  # whole lines, so that it stays Markdown
    console.print((folder / "card.md").read_text(), markup=False, highlight=False)
    console.print(f"artifact: {folder}", markup=False, highlight=False)
