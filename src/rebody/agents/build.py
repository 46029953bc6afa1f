"""From parts to an agent."""

from typing import Literal

from rebody.agents.agent import Agent
from rebody.agents.fits import ANY_WALKER, check_predictor, check_slots
from rebody.agents.kinds import KINDS, Ingredients
from rebody.agents.parts import (
    Inference,
    LoadedFlat,
    LoadedHighLevel,
    LoadedScratch,
    LoadedSlots,
    LoadedStepPredictor,
    LoadedTracker,
    ScratchParts,
)
from rebody.agents.slots import OneSlot, SlotChooser, SlotOfBelief, SlotOfCluster
from rebody.bodies import RobotSpec
from rebody.control.slot_policy import SlotPolicy
from rebody.control.step_predictor import is_predictable
from rebody.errors import RebodyError, unknown
from rebody.store import tree_hash
from rebody.tasks import FamilySet
from rebody.types import Task

HORIZON = 15
"""Decisions that `reuse` looks ahead; 1 is the thesis."""
SlotsBy = Literal["belief", "classifier", "clusters"]
"""How `reuse` chooses a tracker's slot: the family that the belief itself says is meant, a classifier on the latent
that learned with labels (thesis 6.4), or the mixture's components."""


def check_agent(kind: str) -> None:
    """RebodyError if there is no agent of that kind."""
    if kind not in KINDS:
        raise unknown("agent", kind, KINDS)


def check_robot_of(
    part: LoadedTracker | LoadedFlat | LoadedScratch | LoadedHighLevel | LoadedStepPredictor, spec: RobotSpec
) -> None:
    """RebodyError if a policy was trained on another robot, or on another description of it."""
    if part.robot != (spec.name if spec.walking is None else ANY_WALKER):
        raise RebodyError(f"'{part.name}' was trained on '{part.robot}', not on '{spec.name}'.")
    if isinstance(part, LoadedTracker) and part.tracker.joints != spec.tracker_inputs:
        raise RebodyError(
            f"'{part.name}' was trained on another description of '{spec.name}': it sees {part.tracker.joints} numbers "
            f"of the body, which now gives {spec.tracker_inputs}. "
            f"Train it anew (rebody train tracker {spec.name})."
        )


def check_module_of(what: str, part: LoadedFlat | LoadedHighLevel | LoadedSlots, inference: Inference) -> None:
    """RebodyError if a part, called `what`, was trained on the beliefs of another module."""
    if part.inference_hash != tree_hash(inference.parts.module):
        raise RebodyError(
            f"{what} '{part.name}' was trained on the beliefs of another module than '{inference.name}'. "
            "Use that one (its card names it), or train it anew."
        )


def check_tracker_of(what: str, part: LoadedHighLevel | LoadedStepPredictor, tracker: LoadedTracker) -> None:
    """RebodyError if a part, called `what`, was trained with another tracker."""
    if part.tracker_hash != tree_hash(tracker.tracker):
        raise RebodyError(
            f"{what} '{part.name}' was trained with another tracker than '{tracker.name}'. "
            "Use that one (its card names it), or train it anew."
        )


def check_step_predictor(part: LoadedStepPredictor, tracker: LoadedTracker, inference: Inference) -> None:
    """RebodyError if a step predictor knows another tracker, or not all that the module's subgoals may be about."""
    check_tracker_of("step predictor", part, tracker)
    check_predictor(part, tracker)
    without = [family.name for family in inference.contract.families if not is_predictable(family)]
    if without:
        raise RebodyError(
            f"step predictor '{part.name}' knows goals and speeds, and '{inference.name}' may ask for "
            f"{', '.join(without)}. Use a fixed --stride."
        )


def slot_chooser(inference: Inference, loaded: LoadedSlots | None, by: SlotsBy) -> SlotChooser:
    """What chooses the slot of subgoals; a module of one family has nothing to choose.

    RebodyError if an artifact is missing, was made for another module, or the module has no experts or no mixture to
    go by.
    """
    decoder = inference.parts.module.decoder
    if by == "belief" and len(inference.contract.families) > 1:
        if decoder.choice is None:
            raise RebodyError(f"the beliefs of '{inference.name}' do not say which family is meant: use a classifier.")
        return SlotOfBelief(decoder)
    if loaded is None:
        if len(inference.contract.families) != 1:
            raise RebodyError(
                f"'{inference.name}' tells several families apart: `reuse` needs a classifier to choose the tracker's "
                "slot (rebody train classifier)."
            )
        return OneSlot()
    check_module_of("classifier", loaded, inference)
    check_slots(loaded, inference)
    if by == "classifier":
        return loaded.parts.classifier
    if inference.parts.mixture is None:
        raise RebodyError(f"'{inference.name}' has no mixture, so no clusters to choose slots by.")
    return SlotOfCluster(inference.parts.mixture, loaded.parts.of_cluster)


def build_agent(
    kind: str,
    inference: Inference,
    tasks: Task | None = None,
    *,
    families: FamilySet | None = None,
    slots: SlotChooser | None = None,
    high_level: SlotPolicy | None = None,
    scratch: ScratchParts | None = None,
    stride: int = 1,
    horizon: int = HORIZON,
    sharpen: bool = False,
) -> Agent:
    """An agent of a named kind; `oracle` needs the tasks, the active ones [time, episode], `retrain` its policy,
    `scratch` its own module, and `reuse` on a robot what chooses its slots (a point mass has none: the module's first
    family stands for all). `families` are those in play, the module's first, which is all by default. `sharpen` has
    `reuse` and `readout` sharpen their beliefs, where the module can; policies that learned on a robot have the beliefs
    that they learned with.

    RebodyError if there is no such kind, or the module cannot serve it.
    """
    check_agent(kind)
    in_play = families or inference.contract.families
    return KINDS[kind].build(
        Ingredients(inference, in_play, tasks, slots, high_level, scratch, stride, horizon, sharpen)
    )
