"""What the config.json of each kind of artifact says, and what has to hold of it before anything is built from it.

Annotations set types and ranges; `__post_init__` says what they cannot, as a ValueError that begins with the key. What
nothing is built from may be missing. `training` holds the settings of the run: it is read where that is wanted.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from msgspec import Meta

from rebody.bodies.toys import TOYS, Toy
from rebody.control.high_level import PolicyView
from rebody.control.places import Places
from rebody.errors import RebodyError
from rebody.inference import InferenceConfig
from rebody.inference.contract import CONTRACT_VERSION, Contract
from rebody.inference.mixture.settings import MixtureConfig
from rebody.ranges import Copies, Layers, Number, Positive
from rebody.store.typed import Misfit, Typed, typed
from rebody.tasks import FamilySet
from rebody.types import GLOBAL_FIELDS

Name = Annotated[str, Meta(max_length=255, pattern=r"^[^\x00-\x1f\x7f]+$")]
"""Of a robot or an artifact: nothing that a terminal would obey."""
Hash = Annotated[str, Meta(max_length=64)]
"""SHA-256 in hex, of the weights of another artifact."""
SMALLEST = 1e-6
"""What is divided by a smaller scale may overflow."""


def understood(value: Any, kind: type[Typed], name: str) -> Typed:
    """The settings of the artifact of that name, or a part of them, as the type that says what they mean.

    RebodyError that names the artifact, the key and what is wrong.
    """
    try:
        return typed(value, kind)
    except Misfit as misfit:
        raise RebodyError(
            f"the settings of artifact '{name}' are not understood ({misfit}): another release of rebody made it, or "
            "it was edited. Install that release, or train the artifact again."
        ) from misfit


@dataclass(frozen=True)
class ToyPolicySettings:
    """The toy's high-level policy."""

    fields: tuple[str, ...]
    """Of the global state that it sees."""
    scales: tuple[Positive, ...]
    """What each of them is divided by [m, rad, m/s]."""
    hidden: Layers
    projections: Number
    acts_by: Literal["belief", "task"] = "belief"
    """Whether one was learned that goes by beliefs, or that alone which is told the task."""


@dataclass(frozen=True)
class InferenceSettings:
    """Of an inference module, with the toy that it learned on."""

    contract: Contract
    inference: InferenceConfig
    high_level: ToyPolicySettings
    toy: dict[str, Any]
    """As `describe_toy` has it."""
    mixture: MixtureConfig | None = None
    training: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self):
        """ValueError for what cannot be built."""
        _check_module(self.contract, self.inference)
        _check_fields("high_level.", self.high_level.fields, self.high_level.scales)
        if self.mixture and not self.mixture.fits(self.inference.clustered):
            raise ValueError(f"mixture.maximum: {self.mixture.maximum} is too much for such a latent")
        self.make_toy()

    def make_toy(self) -> Toy:
        """The point mass that the module learned on."""
        kind = self.toy.get("kind")
        if not isinstance(kind, str) or kind not in TOYS:
            raise Misfit(f"toy.kind: unknown toy {kind!r:.50}. Toys are: {', '.join(TOYS)}")
        return typed({name: value for name, value in self.toy.items() if name != "kind"}, TOYS[kind], "toy")


@dataclass(frozen=True)
class TrackerSettings:
    """Of a robot's tracker."""

    robot: Name
    families: FamilySet
    """What it can be commanded to do, each with the range that it was trained for."""
    observations: Copies
    actions: Copies
    hidden: Layers
    projections: Number
    control_dt: Positive | None = None
    """Simulated seconds of a control step, for the reader."""
    training: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class FlatSettings:
    """Of a flat policy."""

    robot: Name
    inference_hash: Hash
    reach: Positive
    observations: Copies
    actions: Copies
    hidden: Layers
    projections: Number
    places: Places = ()
    inference: Name | None = None
    training: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self):
        """ValueError for places that are none."""
        _check_places("places", self.places)


@dataclass(frozen=True)
class ScratchSettings:
    """Of a module and a policy that were learned together on a robot."""

    robot: Name
    contract: Contract
    inference: InferenceConfig
    observations: Copies
    actions: Copies
    hidden: Layers
    projections: Number
    training: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self):
        """ValueError for what cannot be built."""
        _check_module(self.contract, self.inference)


@dataclass(frozen=True)
class HighLevelSettings:
    """Of a high-level policy that was learned on a robot."""

    robot: Name
    inference_hash: Hash
    tracker_hash: Hash
    view: PolicyView
    slots: Places
    """Of each family, what a value of 1 asks for [m ahead, m/s, rad]."""
    observations: Copies
    hidden: Layers
    projections: Number
    inference: Name | None = None
    tracker: Name | None = None
    training: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self):
        """ValueError for a view or slots that cannot be."""
        _check_fields("view.", self.view.fields, self.view.scales)
        _check_places("view.places", self.view.places)
        if not self.slots:
            raise ValueError("slots: there must be at least one")
        _check_places("slots", self.slots)


@dataclass(frozen=True)
class StepPredictorSettings:
    """Of a tracker's step predictor."""

    robot: Name
    tracker_hash: Hash
    families: FamilySet
    """Of its tracker."""
    observations: Copies
    hidden: Layers
    projections: Number
    tracker: Name | None = None
    training: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class ClassifierSettings:
    """Of what chooses a slot by a belief."""

    inference_hash: Hash
    latent: Copies
    families: tuple[Name, ...]
    """Of the module, in its order."""
    hidden: Layers
    components: Annotated[int, Meta(ge=0, le=4096)]
    """Of the module's mixture; 0 without one."""
    inference: Name | None = None
    training: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self):
        """ValueError for no families, or one that comes twice."""
        if not self.families or len(set(self.families)) < len(self.families):
            raise ValueError("families: there must be at least one, and none twice")


def _check_module(contract: Contract, inference: InferenceConfig) -> None:
    if contract.version != CONTRACT_VERSION:
        raise ValueError(f"contract: it has version {contract.version}, this release reads {CONTRACT_VERSION}")
    _check_fields("inference.", inference.fields, inference.scales)
    _check_divisors("inference.reward_scale", [inference.reward_scale])
    if contract.fields != inference.fields:
        raise ValueError(f"contract.fields: {', '.join(contract.fields)}, but the encoder sees {inference.fields}")
    if contract.window != inference.window:
        raise ValueError(f"contract.window: {contract.window}, but the encoder's is {inference.window}")
    inference.check(contract.families)


def _check_fields(where: str, names: Sequence[str], scales: Sequence[float]) -> None:
    _check_known(f"{where}fields", names, GLOBAL_FIELDS)
    if len(scales) != len(names):
        raise ValueError(f"{where}scales: {len(scales)} numbers for {len(names)} fields")
    _check_divisors(f"{where}scales", scales)


def _check_places(key: str, places: Places) -> None:
    for i, place in enumerate(places):
        _check_fields(f"{key}[{i}].", place.quantity.components, place.scales)


def _check_divisors(key: str, numbers: Sequence[float]) -> None:
    if min(numbers) < SMALLEST:
        raise ValueError(f"{key}: {min(numbers)} is too small to divide by")


def _check_known(key: str, names: Sequence[str], known: Sequence[str]) -> None:
    if not names or len(set(names)) < len(names):
        raise ValueError(f"{key}: there must be at least one, and none twice")
    if unknown := [name for name in names if name not in known]:
        raise ValueError(f"{key}: {unknown[0]!r:.50} is unknown; there are {', '.join(known)}")
