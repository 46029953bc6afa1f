"""Whether parts have the sizes that a module and a robot need: what an artifact says of itself is not trusted."""

from rebody.agents.parts import (
    Inference,
    LoadedFlat,
    LoadedHighLevel,
    LoadedScratch,
    LoadedSlots,
    LoadedStepPredictor,
    LoadedTracker,
)
from rebody.bodies import RobotSpec
from rebody.control.places import Places, numbers_of
from rebody.control.sac import Actor
from rebody.errors import RebodyError

ANY_WALKER = "joystick"
"""The robot of a navigator: all that walk by a policy of their own."""


def check_sizes(part: LoadedTracker | LoadedFlat | LoadedScratch | LoadedHighLevel, spec: RobotSpec, module: Inference):
    """RebodyError where a policy does not see what the robot and the module's beliefs give, or moves other joints."""
    latent = module.parts.module.encoder.latent
    match part:
        case LoadedTracker(tracker=tracker):
            _check_actor(part.name, tracker.actor, tracker.actor.observations, spec.actions)
        case LoadedFlat(policy=policy):
            _check_places(part.name, policy.view.places, module)
            _check_actor(part.name, policy.actor, policy.view.size(spec.joint_inputs, latent), spec.actions)
        case LoadedScratch(parts=parts):
            own = parts.module.encoder.latent
            _check_actor(part.name, parts.policy.actor, parts.policy.view.size(spec.joint_inputs, own), spec.actions)
        case LoadedHighLevel(policy=policy):
            _check_places(part.name, policy.view.places, module)
            if [slot.quantity for slot in policy.slots] != [family.quantity for family in module.contract.families]:
                raise _misfit(part.name, f"its slots are not those of '{module.name}'")
            _check_actor(part.name, policy.actor, policy.view.size(latent), numbers_of(policy.slots))


def check_predictor(part: LoadedStepPredictor, tracker: LoadedTracker) -> None:
    """RebodyError where a step predictor does not see commands as its tracker does."""
    if part.predictor.families != tracker.tracker.families:
        raise _misfit(part.name, "its commands are not those of its tracker")
    _check_actor(part.name, part.predictor.actor, tracker.tracker.actor.observations, 1)


def check_slots(part: LoadedSlots, module: Inference) -> None:
    """RebodyError where a classifier does not see the module's beliefs, or chooses among other families."""
    classifier, mixture = part.parts.classifier, module.parts.mixture
    if len(classifier.net.weights[0]) != module.parts.module.encoder.latent:
        raise _misfit(part.name, f"its latent is not that of '{module.name}'")
    if part.families != module.contract.families.names:
        raise _misfit(part.name, f"its families are not those of '{module.name}'")
    if mixture is not None and len(part.parts.of_cluster) != len(mixture.active):
        raise _misfit(part.name, f"its clusters are not those of '{module.name}'")


def _check_places(name: str, places: Places, module: Inference) -> None:
    if places != module.places:
        raise _misfit(name, "the places that it sees are not those that the module's beliefs speak of")


def _check_actor(name: str, actor: Actor, sees: int, moves: int) -> None:
    if (actor.observations, actor.actions) != (sees, moves):
        given = f"sees {actor.observations} numbers and gives {actor.actions}"
        raise _misfit(name, f"it {given}, where {sees} and {moves} are needed")


def _misfit(name: str, what: str) -> RebodyError:
    return RebodyError(f"'{name}' does not fit: {what}. Train it anew.")
