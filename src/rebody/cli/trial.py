"""Options that all commands share which put an agent to the test."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from rebody.agents.build import HORIZON, SlotsBy, check_agent
from rebody.agents.parts import (
    LoadedFlat,
    LoadedHighLevel,
    LoadedScratch,
    LoadedStepPredictor,
    load_flat,
    load_high_level,
    load_inference,
    load_scratch,
    load_slots_of,
    load_step_predictor,
    load_tracker,
)
from rebody.bodies import RobotSpec, load_robot
from rebody.errors import RebodyError
from rebody.evaluation.evaluate import POINT_MASS, Trial
from rebody.names import AGENTS
from rebody.tasks import SHIPPED
from rebody.ranges import Count, Decisions, Seconds, check_ranges

AGENT_HELP = "; ".join(f"{name}: {what}" for name, what in AGENTS.items())


@dataclass(frozen=True)
class TrialOptions:
    """Who is put to the test, and where."""

    robot: str = "cheetah"
    """Body (see `rebody list`)."""
    inference: str = "goal-velocity"
    """Inference artifact: a shipped name or a folder."""
    agent: Annotated[str, tyro.conf.arg(help=AGENT_HELP)] = "reuse"
    tracker: str | None = None
    """Tracker artifact; default tracker-ROBOT."""
    flat: str | None = None
    """Policy of agent `flat`; default flat-INFERENCE-ROBOT."""
    scratch: str | None = None
    """Artifact of agent `scratch`; default scratch-ROBOT."""
    high_level: str | None = None
    """Policy of agent `retrain`; default high-level-INFERENCE-ROBOT."""
    classifier: str | None = None
    """What chooses the slots of `reuse`; default classifier-INFERENCE where a module knows several families."""
    slots_by: SlotsBy = "classifier"
    """Choose them by the classifier, or by the mixture's clusters."""
    seconds: Seconds = 20.0
    """Length of an episode."""
    stride: Count | Literal["predicted"] = 1
    """Decisions for which a subgoal is held; in thesis mode control steps from one decision to the next, a number or
    chosen anew each time by the step predictor (6.4.3)."""
    step_predictor: str | None = None
    """Step predictor of `--stride predicted`; default step-predictor-ROBOT."""
    horizon: Decisions | None = None
    """Decisions that `reuse` looks ahead; default 15, in thesis mode 1."""
    thesis: bool = False
    """Thesis mode (6.3.3): the module hears of the world once per stride only."""

    def load(self) -> Trial:
        """Load the parts; RebodyError where an option makes no sense or a part cannot be had."""
        check_ranges(self)
        check_agent(self.agent)
        stride = self._fixed_stride()
        robot = None if self.robot == POINT_MASS else load_robot(self.robot)
        inference = load_inference(self.inference)
        bridged = robot is not None and self.agent == "reuse"
        return Trial(
            agent=self.agent,
            robot=robot,
            inference=inference,
            families=SHIPPED,
            tracker=load_tracker(f"tracker-{robot.name}" if self.tracker is None else self.tracker) if robot else None,
            flat=self._flat(robot),
            scratch=self._scratch(robot),
            high_level=self._high_level(robot),
            slots=load_slots_of(inference, self.classifier) if bridged else None,
            slots_by=self.slots_by,
            seconds=self.seconds,
            stride=stride,
            horizon=self.horizon or (1 if self.thesis else HORIZON),
            thesis=self.thesis,
            step_predictor=self._step_predictor(robot),
        )

    def _fixed_stride(self) -> int:
        """The number, 1 where there is none; RebodyError where nothing can be predicted."""
        if self.stride != "predicted":
            return self.stride
        if not self.thesis:
            raise RebodyError("--stride predicted is of thesis mode: add --thesis, or give a number of decisions.")
        if self.robot == POINT_MASS:
            raise RebodyError("--stride predicted counts control steps of a robot; a point mass has none.")
        return 1

    def _flat(self, robot: RobotSpec | None) -> LoadedFlat | None:
        if robot is None or self.agent != "flat":
            return None
        return load_flat(f"flat-{Path(self.inference).name}-{robot.name}" if self.flat is None else self.flat)

    def _scratch(self, robot: RobotSpec | None) -> LoadedScratch | None:
        if robot is None or self.agent != "scratch":
            return None
        return load_scratch(f"scratch-{robot.name}" if self.scratch is None else self.scratch)

    def _high_level(self, robot: RobotSpec | None) -> LoadedHighLevel | None:
        if robot is None or self.agent != "retrain":
            return None
        return load_high_level(
            f"high-level-{Path(self.inference).name}-{robot.name}" if self.high_level is None else self.high_level
        )

    def _step_predictor(self, robot: RobotSpec | None) -> LoadedStepPredictor | None:
        if robot is None or self.stride != "predicted":
            return None
        return load_step_predictor(
            f"step-predictor-{robot.name}" if self.step_predictor is None else self.step_predictor
        )
