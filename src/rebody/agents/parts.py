"""From artifacts to parts."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Int

from rebody.agents.belief import LiveBelief
from rebody.agents.configs import (
    ClassifierSettings,
    FlatSettings,
    HighLevelSettings,
    InferenceSettings,
    ScratchSettings,
    StepPredictorSettings,
    ToyPolicySettings,
    TrackerSettings,
    understood,
)
from rebody.agents.slots import SlotClassifier
from rebody.bodies import RobotSpec
from rebody.bodies.toys import Toy
from rebody.control.flat import FlatPolicy, FlatView
from rebody.control.high_level import HighLevelPolicy, PolicyView
from rebody.control.places import Place, Places, TaskCode, numbers_of, places_of
from rebody.control.sac import Actor, SACConfig
from rebody.control.slot_policy import SlotPolicy
from rebody.control.step_predictor import StepPredictor
from rebody.control.tracker import Tracker
from rebody.errors import RebodyError
from rebody.inference import Encoder, InferenceConfig, InferenceModule
from rebody.inference.any_law import SharpenedByAnyLaw
from rebody.inference.contract import Contract
from rebody.inference.mixture.padded import MixturePrior, no_mixture
from rebody.inference.probe import Probe, unfitted
from rebody.inference.reader import PlaceReader
from rebody.inference.sharpened import Sharpened, can_sharpen
from rebody.jax_settings import own_jax_settings
from rebody.nn import MLP
from rebody.store import arrays_into_tree, load_artifact
from rebody.store.typed import Typed
from rebody.tasks import FamilySet
from rebody.types import AnyArray, Tree


class InferenceParts(eqx.Module):
    """What an inference artifact holds: the frozen module, the toy's policies, and the probe."""

    module: InferenceModule
    high_level: HighLevelPolicy | None  # acts by a belief, where there is one that learned to
    told_policy: HighLevelPolicy  # the same, told the task: the toy's oracle
    probe: Probe
    mixture: MixturePrior | None  # the clusters of beliefs, where there is a mixture


@dataclass(frozen=True)
class Inference:
    """A loaded inference artifact."""

    name: str
    contract: Contract
    parts: InferenceParts
    toy: Toy

    @property
    def places(self) -> Places:
        """What its beliefs say the places of, in units of the encoder's scales; none for a latent that is not split."""
        decoder = self.parts.module.decoder
        if decoder.choice is None:
            return ()
        of_each = zip(self.contract.families, decoder.experts, strict=True)
        return tuple(Place(family.quantity, expert.scales) for family, expert in of_each)

    @property
    def view(self) -> PolicyView:
        """What a policy sees that goes by its beliefs."""
        return replace(self.parts.told_policy.view, places=self.places)

    @property
    def task_code(self) -> TaskCode:
        """How a task is put to the policy that is told it."""
        return TaskCode(places_of(self.contract.families))

    @property
    def can_sharpen(self) -> bool:
        """Whether its beliefs can be sharpened; they stay as they are where no expert says a family's place."""
        module = self.parts.module
        return can_sharpen(module.encoder, module.decoder, self.contract.families)

    def believing(self, sharpen: bool) -> tuple[Encoder | Sharpened | SharpenedByAnyLaw, Probe | PlaceReader]:
        """What believes, and what reads its beliefs: sharpened where that is wanted and can be, else the encoder."""
        module = self.parts.module
        if not (sharpen and self.can_sharpen):
            return module.encoder, self.parts.probe
        if module.decoder.hears_any_law:
            return SharpenedByAnyLaw(module.encoder, module.decoder), PlaceReader(
                module.decoder, self.contract.families
            )
        sharpened = Sharpened(module.encoder, module.decoder, tells_evidence=self.parts.high_level is None)
        return sharpened, PlaceReader(module.decoder, self.contract.families)

    @own_jax_settings()
    def begin(self, state: Any, sharpen: bool = False) -> LiveBelief:
        """The belief about a task that begins in this state: its `update` takes in every decision of 0.1 s.

        `state` is a mapping with the fields of the contract (m, rad, m/s, rad/s) as `LiveBelief.update` has them.
        With `sharpen` beliefs are refined, which needs rewards of the very states that are told: not means over a time.
        RebodyError if the module hears of a body at other times, or a field is missing.
        """
        self.contract.check_time()
        inferrer, reader = self.believing(sharpen)
        return LiveBelief(inferrer, reader, self.parts.mixture, self.contract, state)


@dataclass(frozen=True)
class LoadedTracker:
    """A loaded tracker artifact."""

    name: str
    robot: str
    tracker: Tracker


@dataclass(frozen=True)
class LoadedFlat:
    """A loaded flat policy; it understands the beliefs of one module only."""

    name: str
    robot: str
    inference_hash: str
    """Of the module's weights."""
    policy: FlatPolicy


class ScratchParts(eqx.Module):
    """What a scratch artifact holds: module, policy and probe, all learned on one robot."""

    module: InferenceModule
    policy: FlatPolicy
    probe: Probe


@dataclass(frozen=True)
class LoadedScratch:
    """A loaded scratch artifact: it believes and acts by itself."""

    name: str
    robot: str
    contract: Contract
    parts: ScratchParts


@dataclass(frozen=True)
class LoadedHighLevel:
    """A loaded high-level policy of a robot; it understands the beliefs of one module, and commands one tracker."""

    name: str
    robot: str
    inference_hash: str
    """Of the module's weights."""
    tracker_hash: str
    """Of the tracker's weights."""
    policy: SlotPolicy


@dataclass(frozen=True)
class LoadedStepPredictor:
    """A loaded step predictor; it knows how fast one tracker is."""

    name: str
    robot: str
    tracker_hash: str
    """Of the tracker's weights."""
    predictor: StepPredictor


class SlotParts(eqx.Module):
    """What a classifier artifact holds: two ways to choose a slot."""

    classifier: SlotClassifier
    of_cluster: Int[AnyArray, " K"]  # the slot of each of the mixture's components; empty without a mixture


@dataclass(frozen=True)
class LoadedSlots:
    """A loaded classifier artifact; it understands the beliefs of one module only."""

    name: str
    inference_hash: str
    """Of the module's weights."""
    families: tuple[str, ...]
    """Of the module, in its order."""
    parts: SlotParts


def inference_template(settings: InferenceSettings) -> InferenceParts:
    """Parts of the right shapes, to be filled with weights."""
    policy, module, families = settings.high_level, settings.inference, settings.contract.families
    actions, mixture = settings.make_toy().actions, settings.mixture
    view, told = PolicyView(policy.fields, policy.scales, module_places(module, families)), places_of(families)
    return InferenceParts(
        module=InferenceModule(module, families, actions, jax.random.key(0)),
        high_level=_policy_template(view, module.latent, actions, policy) if policy.acts_by == "belief" else None,
        told_policy=_policy_template(told_view(view, families), len(told) + numbers_of(told), actions, policy),
        probe=unfitted(families, module.latent),
        mixture=no_mixture(mixture.maximum, module.clustered) if mixture else None,
    )


def tracker_template(settings: TrackerSettings) -> Tracker:
    """A tracker of the right shapes, to be filled with weights."""
    return Tracker(
        _actor_template(settings.observations, settings.actions, settings.hidden, settings.projections),
        settings.families,
    )


def flat_template(settings: FlatSettings) -> FlatPolicy:
    """A flat policy of the right shapes, to be filled with weights."""
    actor = _actor_template(settings.observations, settings.actions, settings.hidden, settings.projections)
    return FlatPolicy(actor, FlatView(settings.places, settings.reach))


def scratch_template(settings: ScratchSettings) -> ScratchParts:
    """Parts of the right shapes, to be filled with weights."""
    module, families = settings.inference, settings.contract.families
    actor = _actor_template(settings.observations, settings.actions, settings.hidden, settings.projections)
    return ScratchParts(
        module=InferenceModule(module, families, settings.actions, jax.random.key(0)),
        policy=FlatPolicy(actor, FlatView(module_places(module, families))),
        probe=unfitted(families, module.latent),
    )


def slot_policy_template(settings: HighLevelSettings) -> SlotPolicy:
    """A high-level policy of a robot of the right shapes, to be filled with weights."""
    actions = numbers_of(settings.slots)
    actor = _actor_template(settings.observations, actions, settings.hidden, settings.projections)
    return SlotPolicy(actor, settings.view, settings.slots)


def step_predictor_template(settings: StepPredictorSettings) -> StepPredictor:
    """A step predictor of the right shapes, to be filled with weights."""
    return StepPredictor(
        _actor_template(settings.observations, 1, settings.hidden, settings.projections), settings.families
    )


def slots_template(settings: ClassifierSettings) -> SlotParts:
    """A classifier of the right shapes, to be filled with weights."""
    net = MLP(settings.latent, len(settings.families), settings.hidden, key=jax.random.key(0))
    return SlotParts(SlotClassifier(net), np.zeros(settings.components, np.int32))


@own_jax_settings()
def load_inference(reference: str) -> Inference:
    """A shipped inference artifact by name, or one in a folder; RebodyError if it cannot be read."""
    name, settings, parts = _load(reference, "inference", InferenceSettings, inference_template)
    return Inference(name, settings.contract, parts, settings.make_toy())


def load_tracker(reference: str) -> LoadedTracker:
    """A shipped tracker artifact by name, or one in a folder; RebodyError if it cannot be read."""
    name, settings, tracker = _load(reference, "tracker", TrackerSettings, tracker_template)
    return LoadedTracker(name, settings.robot, tracker)


def tracker_of(spec: RobotSpec) -> str:
    """Name of the tracker that a robot follows where no other is asked for: of one that walks already the navigator."""
    return f"tracker-{spec.name}" if spec.walking is None else "navigator"


def load_flat(reference: str) -> LoadedFlat:
    """A shipped flat policy by name, or one in a folder; RebodyError if it cannot be read."""
    name, settings, policy = _load(reference, "flat", FlatSettings, flat_template)
    return LoadedFlat(name, settings.robot, settings.inference_hash, policy)


def load_scratch(reference: str) -> LoadedScratch:
    """A shipped scratch artifact by name, or one in a folder; RebodyError if it cannot be read."""
    name, settings, parts = _load(reference, "scratch", ScratchSettings, scratch_template)
    return LoadedScratch(name, settings.robot, settings.contract, parts)


def load_high_level(reference: str) -> LoadedHighLevel:
    """A shipped high-level policy of a robot by name, or one in a folder; RebodyError if it cannot be read."""
    name, settings, policy = _load(reference, "high-level", HighLevelSettings, slot_policy_template)
    return LoadedHighLevel(name, settings.robot, settings.inference_hash, settings.tracker_hash, policy)


def load_step_predictor(reference: str) -> LoadedStepPredictor:
    """A shipped step predictor by name, or one in a folder; RebodyError if it cannot be read."""
    name, settings, predictor = _load(reference, "step-predictor", StepPredictorSettings, step_predictor_template)
    return LoadedStepPredictor(name, settings.robot, settings.tracker_hash, predictor)


def load_slots(reference: str) -> LoadedSlots:
    """A shipped classifier by name, or one in a folder; RebodyError if it cannot be read."""
    name, settings, parts = _load(reference, "classifier", ClassifierSettings, slots_template)
    slots = np.asarray(parts.of_cluster)
    if len(slots) and not 0 <= slots.min() <= slots.max() < len(settings.families):
        raise RebodyError(
            f"the weights of artifact '{name}' are not understood (of_cluster: {slots.min()} to {slots.max()} are not "
            f"indices of {', '.join(settings.families)}). Copy or make the artifact anew."
        )
    return LoadedSlots(name, settings.inference_hash, settings.families, parts)


def load_slots_of(inference: Inference, reference: str | None) -> LoadedSlots | None:
    """The named classifier, else the shipped one of a module that needs one; RebodyError if it cannot be had."""
    if reference is None and len(inference.contract.families) == 1:
        return None
    return load_slots(f"classifier-{inference.name}" if reference is None else reference)


def module_places(config: InferenceConfig, families: FamilySet) -> Places:
    """What a split latent says the places of (`Decoder.interpret`), in units of the encoder's scales; else none."""
    scale_of = dict(zip(config.fields, config.scales, strict=True))
    if not config.kinds:
        return ()
    return tuple(Place(each.quantity, tuple(scale_of[name] for name in each.quantity.components)) for each in families)


def told_view(view: PolicyView, families: FamilySet) -> PolicyView:
    """What a privileged policy sees, beside one that sees a belief: places where that sees places."""
    return replace(view, places=places_of(families) if view.places else ())


def _load(
    reference: str, kind: str, settings_of: type[Typed], template: Callable[[Typed], Tree]
) -> tuple[str, Typed, Tree]:
    """Name, settings and parts of an artifact; no random weights are drawn, and none allocated before all fit."""
    artifact = load_artifact(reference, kind)
    settings = understood(artifact.config, settings_of, artifact.name)
    shapes = eqx.filter_eval_shape(lambda: template(settings))
    return artifact.name, settings, arrays_into_tree(shapes, artifact.arrays, f"artifact {artifact.name}")


def _policy_template(view: PolicyView, believed: int, actions: int, sizes: ToyPolicySettings) -> HighLevelPolicy:
    return HighLevelPolicy(_actor_template(view.size(believed), actions, sizes.hidden, sizes.projections), view)


def _actor_template(observations: int, actions: int, hidden: tuple[int, ...], projections: int) -> Actor:
    return Actor(observations, actions, SACConfig(hidden=hidden, projections=projections), jax.random.key(0))
