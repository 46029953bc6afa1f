"""From artifacts to parts."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Int

from rebody.agents.belief import LiveBelief
from rebody.agents.slots import SlotClassifier
from rebody.bodies.robot import Reach
from rebody.bodies.toys import Toy, make_toy
from rebody.control.flat import FlatPolicy, FlatView
from rebody.control.high_level import HighLevelPolicy, PolicyView, TaskCode
from rebody.control.sac import Actor, SACConfig
from rebody.control.slot_policy import SlotPolicy
from rebody.control.step_predictor import StepPredictor
from rebody.control.tracker import Tracker
from rebody.errors import RebodyError
from rebody.inference import InferenceConfig, InferenceModule
from rebody.inference.contract import Contract
from rebody.inference.mixture.padded import MixturePrior, no_mixture
from rebody.inference.probe import Probe
from rebody.jax_settings import own_jax_settings
from rebody.nn import MLP
from rebody.store import Artifact, arrays_into_tree, load_artifact
from rebody.tasks import family_index
from rebody.types import AnyArray, Tree


class InferenceParts(eqx.Module):
    """What an inference artifact holds: the frozen module, the toy's policies, and the probe."""

    module: InferenceModule
    high_level: HighLevelPolicy  # acts by a belief
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
    def task_code(self) -> TaskCode:
        """How a task is put to the policy that is told it."""
        return task_code(self.contract.target_ranges)

    @own_jax_settings()
    def begin(self, state: Any) -> LiveBelief:
        """The belief about a task that begins in this state: its `update` takes in every decision of 0.1 s.

        `state` is a mapping with the fields of the contract (m, rad, m/s, rad/s) as `LiveBelief.update` has them.
        RebodyError if the module hears of a body at other times, or a field is missing.
        """
        self.contract.check_time()
        parts = self.parts
        return LiveBelief(parts.module.encoder, parts.probe, parts.mixture, self.contract, state)


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
    parts: SlotParts


def inference_template(config: dict[str, Any]) -> InferenceParts:
    """Parts of the right shapes, to be filled with weights."""
    inference, policy, mixture = config["inference"], config["high_level"], config.get("mixture")
    actions = make_toy(**config["toy"]).actions
    settings = InferenceConfig(**with_tuples(inference))
    ranges = with_tuples(config["contract"]["target_ranges"])
    view = PolicyView(tuple(policy["fields"]), tuple(policy["scales"]), settings.places)
    weights = np.zeros((settings.latent + 1, len(ranges)), np.float32)
    return InferenceParts(
        module=InferenceModule(settings, actions, jax.random.key(0)),
        high_level=_policy_template(view, settings.latent, actions, policy),
        told_policy=_policy_template(told_view(view, ranges), 2 * len(ranges), actions, policy),
        probe=Probe(np.zeros(len(ranges), np.int32), weights, weights),
        mixture=no_mixture(mixture["maximum"], settings.clustered) if mixture else None,
    )


def tracker_template(config: dict[str, Any]) -> Tracker:
    """A tracker of the right shapes, to be filled with weights."""
    actor = _actor_template(config["observations"], config["actions"], config)
    return Tracker(actor, Reach(**with_tuples(config["reach"])))


def flat_template(config: dict[str, Any]) -> FlatPolicy:
    """A flat policy of the right shapes, to be filled with weights."""
    view = FlatView(tuple(map(tuple, config.get("places", ()))), config["reach"])
    return FlatPolicy(_actor_template(config["observations"], config["actions"], config), view)


def scratch_template(config: dict[str, Any]) -> ScratchParts:
    """Parts of the right shapes, to be filled with weights."""
    settings = InferenceConfig(**with_tuples(config["inference"]))
    families = len(config["contract"]["target_ranges"])
    weights = np.zeros((settings.latent + 1, families), np.float32)
    return ScratchParts(
        module=InferenceModule(settings, config["actions"], jax.random.key(0)),
        policy=FlatPolicy(
            _actor_template(config["observations"], config["actions"], config), FlatView(settings.places)
        ),
        probe=Probe(np.zeros(families, np.int32), weights, weights),
    )


def slot_policy_template(config: dict[str, Any]) -> SlotPolicy:
    """A high-level policy of a robot of the right shapes, to be filled with weights."""
    slots = tuple((family_index(name), scale) for name, scale in config["slots"].items())
    return SlotPolicy(_actor_template(config["observations"], len(slots), config), _view(config), slots)


def step_predictor_template(config: dict[str, Any]) -> StepPredictor:
    """A step predictor of the right shapes, to be filled with weights."""
    return StepPredictor(_actor_template(config["observations"], 1, config), Reach(**with_tuples(config["reach"])))


def slots_template(config: dict[str, Any]) -> SlotParts:
    """A classifier of the right shapes, to be filled with weights."""
    families = tuple(config["families"])
    net = MLP(config["latent"], len(families), tuple(config["hidden"]), key=jax.random.key(0))
    return SlotParts(SlotClassifier(net, families), np.zeros(config["components"], np.int32))


@own_jax_settings()
def load_inference(reference: str) -> Inference:
    """A shipped inference artifact by name, or one in a folder; RebodyError if it cannot be read."""
    artifact = load_artifact(reference, "inference")
    with _understood(artifact):
        contract = Contract.from_config(artifact.config["contract"])
        parts = _fill(inference_template, artifact)
        return Inference(artifact.name, contract, parts, make_toy(**artifact.config["toy"]))


def load_tracker(reference: str) -> LoadedTracker:
    """A shipped tracker artifact by name, or one in a folder; RebodyError if it cannot be read."""
    artifact = load_artifact(reference, "tracker")
    with _understood(artifact):
        return LoadedTracker(artifact.name, artifact.config["robot"], _fill(tracker_template, artifact))


def load_flat(reference: str) -> LoadedFlat:
    """A shipped flat policy by name, or one in a folder; RebodyError if it cannot be read."""
    artifact = load_artifact(reference, "flat")
    with _understood(artifact):
        config = artifact.config
        return LoadedFlat(artifact.name, config["robot"], config["inference_hash"], _fill(flat_template, artifact))


def load_scratch(reference: str) -> LoadedScratch:
    """A shipped scratch artifact by name, or one in a folder; RebodyError if it cannot be read."""
    artifact = load_artifact(reference, "scratch")
    with _understood(artifact):
        contract = Contract.from_config(artifact.config["contract"])
        return LoadedScratch(artifact.name, artifact.config["robot"], contract, _fill(scratch_template, artifact))


def load_high_level(reference: str) -> LoadedHighLevel:
    """A shipped high-level policy of a robot by name, or one in a folder; RebodyError if it cannot be read."""
    artifact = load_artifact(reference, "high-level")
    with _understood(artifact):
        config, policy = artifact.config, _fill(slot_policy_template, artifact)
        return LoadedHighLevel(artifact.name, config["robot"], config["inference_hash"], config["tracker_hash"], policy)


def load_step_predictor(reference: str) -> LoadedStepPredictor:
    """A shipped step predictor by name, or one in a folder; RebodyError if it cannot be read."""
    artifact = load_artifact(reference, "step-predictor")
    with _understood(artifact):
        config, predictor = artifact.config, _fill(step_predictor_template, artifact)
        return LoadedStepPredictor(artifact.name, config["robot"], config["tracker_hash"], predictor)


def load_slots(reference: str) -> LoadedSlots:
    """A shipped classifier by name, or one in a folder; RebodyError if it cannot be read."""
    artifact = load_artifact(reference, "classifier")
    with _understood(artifact):
        return LoadedSlots(artifact.name, artifact.config["inference_hash"], _fill(slots_template, artifact))


def load_slots_of(inference: Inference, reference: str | None) -> LoadedSlots | None:
    """The named classifier, else the shipped one of a module that needs one; RebodyError if it cannot be had."""
    if reference is None and len(inference.contract.families) == 1:
        return None
    return load_slots(reference or f"classifier-{inference.name}")


def task_code(target_ranges: Mapping[str, tuple[float, float]]) -> TaskCode:
    """Targets divided by the largest of their family."""
    return TaskCode(tuple((family_index(name), max(abs(end) for end in ends)) for name, ends in target_ranges.items()))


def told_view(view: PolicyView, target_ranges: Mapping[str, tuple[float, float]]) -> PolicyView:
    """What a policy that is told its task sees, beside one that sees a belief: places where that sees places."""
    return replace(view, places=task_code(target_ranges).places if view.places else ())


def _fill(template: Callable[[dict[str, Any]], Tree], artifact: Artifact) -> Tree:
    """The template of an artifact's configuration with its weights; no random weights are drawn for it."""
    shapes = eqx.filter_eval_shape(lambda: template(artifact.config))
    zeros = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), shapes)
    return arrays_into_tree(zeros, artifact.arrays, f"artifact {artifact.name}")


@contextmanager
def _understood(artifact: Artifact) -> Iterator[None]:
    """Turns what an unfamiliar config.json brings about into a message."""
    try:
        yield
    except (KeyError, TypeError) as error:
        raise RebodyError(
            f"the settings of artifact '{artifact.name}' are not understood ({error}): another release of rebody "
            "made it. Install that release, or train the artifact again."
        ) from error


def _policy_template(view: PolicyView, believed: int, actions: int, config: dict[str, Any]) -> HighLevelPolicy:
    return HighLevelPolicy(_actor_template(view.size(believed), actions, config), view)


def _view(config: dict[str, Any]) -> PolicyView:
    seen = config["view"]
    return PolicyView(tuple(seen["fields"]), tuple(seen["scales"]), tuple(map(tuple, seen["places"])))


def _actor_template(observations: int, actions: int, config: dict[str, Any]) -> Actor:
    sizes = SACConfig(hidden=tuple(config["hidden"]), projections=config["projections"])
    return Actor(observations, actions, sizes, jax.random.key(0))


def with_tuples(settings: dict[str, Any]) -> dict[str, Any]:
    """Settings as they were before JSON made lists of their tuples."""
    return {name: tuple(value) if isinstance(value, list) else value for name, value in settings.items()}
