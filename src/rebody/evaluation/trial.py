"""What is put to the test, and whether its parts fit together."""

from dataclasses import dataclass
from functools import cached_property

from rebody.agents.build import (
    HORIZON,
    SlotsBy,
    check_agent,
    check_module_of,
    check_robot_of,
    check_step_predictor,
    check_tracker_of,
)
from rebody.agents.fits import check_sizes
from rebody.agents.kinds import KINDS
from rebody.agents.parts import (
    Inference,
    LoadedFlat,
    LoadedHighLevel,
    LoadedScratch,
    LoadedSlots,
    LoadedStepPredictor,
    LoadedTracker,
)
from rebody.agents.rollout import OnFrame
from rebody.bodies import RobotSpec
from rebody.bodies.toys import Toy
from rebody.errors import RebodyError
from rebody.inference.contract import Contract
from rebody.tasks import FamilySet, Payment
from rebody.tasks.task_file import TaskSpec
from rebody.types import DECISION_DT

POINT_MASS = "point-mass"


@dataclass(frozen=True)
class Trial:
    """What is put to the test."""

    agent: str
    inference: Inference
    families: FamilySet
    """What a name of a task means beside the module's own; `in_play` has them all."""
    robot: RobotSpec | None
    """None for the point mass."""
    tracker: LoadedTracker | None
    flat: LoadedFlat | None = None
    """The policy of agent `flat`."""
    scratch: LoadedScratch | None = None
    """All of agent `scratch`."""
    high_level: LoadedHighLevel | None = None
    """The policy of agent `retrain`."""
    slots: LoadedSlots | None = None
    """What chooses the slots of `reuse` on a robot, for a module of several families."""
    slots_by: SlotsBy = "classifier"
    sharpen: bool = False
    """Whether beliefs are sharpened, where agent and module can: `reuse` and `readout`, not in thesis mode."""
    toy: Toy | None = None
    """A point mass other than the one that the module learned on."""
    seconds: float = 20.0
    stride: int = 1
    """Decisions that a subgoal is held; in thesis mode control steps from one decision to the next."""
    horizon: int = HORIZON
    thesis: bool = False
    """The encoder ticks once per stride (6.3.3)."""
    step_predictor: LoadedStepPredictor | None = None
    """In thesis mode it chooses each stride anew, in place of `stride` (6.4.3)."""
    payment: Payment | None = None
    """How all tasks are paid; None for each family's own law."""
    goes_exactly: bool = False
    """Whether a robot that walks already goes exactly as its joystick says (`ExactWalkers`), to tell the navigator's
    share from the walking policy's."""
    on_frame: OnFrame | None = None
    """Called at every control step of a robot, to film it."""

    @property
    def robot_name(self) -> str:
        """Name of the body."""
        return POINT_MASS if self.robot is None else self.robot.name

    @property
    def contract(self) -> Contract:
        """Of the module that believes: `scratch` brings its own."""
        return self.scratch.contract if self.scratch else self.inference.contract

    @property
    def module_name(self) -> str:
        """Of that module."""
        return self.scratch.name if self.scratch else self.inference.name

    @cached_property
    def in_play(self) -> FamilySet:
        """The module's families, the tracker's, then all others whose names are known."""
        own = self.contract.families
        return (own.beside(self.tracker.tracker.families) if self.tracker else own).beside(self.families)

    @property
    def sharpens(self) -> bool:
        """Whether the agent's beliefs are sharpened."""
        return self.sharpen and not self.thesis and KINDS[self.agent].sharpens and self.inference.can_sharpen

    @property
    def decisions(self) -> int:
        """Times 0.1 s of one episode."""
        return round(self.seconds / DECISION_DT)


def check_trial(trial: Trial, specs: list[TaskSpec]) -> None:
    """RebodyError where module, policies, tasks and robot do not fit together."""
    check_agent(trial.agent)
    if trial.seconds < 3.0:
        raise RebodyError(f"--seconds {trial.seconds:g} is too short: final errors need the last 2 s of at least 3.")
    kind = KINDS[trial.agent]
    if trial.thesis and not kind.in_thesis_mode:
        able = [name for name, other in KINDS.items() if other.in_thesis_mode]
        raise RebodyError(f"thesis mode is for the agents {', '.join(able)}, not for '{trial.agent}'.")
    if trial.payment is not None:
        _check_payment(trial)
    _check_tasks(trial, specs)
    if trial.robot is None:
        if trial.thesis and trial.stride > 1:
            raise RebodyError("in thesis mode a stride counts control steps of a robot; a point mass has none.")
        if kind.on_robots_alone:
            raise RebodyError(f"agent '{trial.agent}' learned on a robot, and a point mass is none.")
        return
    slots = trial.tracker.tracker.families.names if trial.tracker else tuple(name for name, _ in trial.robot.reach)
    trial.contract.check_body(trial.robot.name, trial.robot.moving_fields, slots)
    if trial.agent == "oracle" and (missing := without_slot(trial, specs)):
        # what the other agents are asked for, their module knows, and that fits the tracker
        assert trial.tracker is not None
        raise RebodyError(
            f"agent 'oracle' is told {', '.join(missing)}, and tracker '{trial.tracker.name}' has no slot for that "
            f"(it has {', '.join(slots)}). Choose tasks or a tracker that fit (rebody list)."
        )
    for part in (trial.tracker, trial.flat, trial.scratch, trial.high_level, trial.step_predictor):
        if part is not None:
            check_robot_of(part, trial.robot)
    if trial.flat is not None:
        check_module_of("flat policy", trial.flat, trial.inference)
    if trial.high_level is not None:
        assert trial.tracker is not None
        check_module_of("high-level policy", trial.high_level, trial.inference)
        check_tracker_of("high-level policy", trial.high_level, trial.tracker)
    if trial.step_predictor is not None:
        assert trial.tracker is not None
        check_step_predictor(trial.step_predictor, trial.tracker, trial.inference)
    for part in (trial.tracker, trial.flat, trial.scratch, trial.high_level):
        if part is not None:
            check_sizes(part, trial.robot, trial.inference)


def without_slot(trial: Trial, specs: list[TaskSpec]) -> list[str]:
    """Families of the tasks that a robot's tracker cannot be commanded in."""
    if trial.tracker is None:
        return []
    asked = dict.fromkeys(family for spec in specs for family in spec.families)
    return [family for family in asked if family not in trial.tracker.tracker.families]


def _check_payment(trial: Trial) -> None:
    if trial.thesis:
        raise RebodyError(
            "a law pays decisions of 0.1 s, and in thesis mode they are others: leave --law or --thesis out."
        )
    if KINDS[trial.agent].by_own_laws:
        raise RebodyError(
            f"agent '{trial.agent}' believes by the families' own laws and makes no sense of another: leave --law out."
        )


def _check_tasks(trial: Trial, specs: list[TaskSpec]) -> None:
    known = trial.contract.families.names
    for spec in specs:
        if spec.switch is not None and round(spec.switch.at_s / DECISION_DT) >= trial.decisions:
            raise RebodyError(f"a switch at {spec.switch.at_s:g} s is not within an episode of {trial.seconds:g} s.")
        for family in spec.families:
            # a robot's oracle and an idle one need no module
            if family not in known and (trial.robot is None or trial.agent not in ("oracle", "idle")):
                raise RebodyError(
                    f"'{trial.module_name}' was trained on {', '.join(known)} and cannot infer '{family}'. "
                    "Choose tasks or a module that fit (rebody list)."
                )
