"""Options that all commands share which put an agent to the test."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from rebody.agents.build import HORIZON, SlotsBy, check_agent
from rebody.agents.parts import (
    Inference,
    load_flat,
    load_high_level,
    load_inference,
    load_scratch,
    load_slots_of,
    load_step_predictor,
    load_tracker,
    tracker_of,
)
from rebody.bodies import RobotSpec, load_robot
from rebody.errors import RebodyError
from rebody.evaluation.trial import POINT_MASS, Trial
from rebody.names import AGENTS
from rebody.ranges import Count, Decisions, Seconds
from rebody.tasks.family_file import read_families
from rebody.tasks.payment import read_payment

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
    """Tracker artifact; default tracker-ROBOT, or the navigator for a robot that walks by a policy of its own."""
    flat: str | None = None
    """Policy of agent `flat`; default flat-INFERENCE-ROBOT."""
    scratch: str | None = None
    """Artifact of agent `scratch`; default scratch-ROBOT."""
    high_level: str | None = None
    """Policy of agent `retrain`; default high-level-INFERENCE-ROBOT."""
    classifier: str | None = None
    """What chooses the slots of `reuse`; default classifier-INFERENCE where a module knows several families."""
    slots_by: SlotsBy | None = None
    """Choose them by the belief itself, by the classifier, or by the mixture's clusters; default is the belief where it
    is sharpened, else the classifier."""
    no_sharpen: bool = False
    """Leave beliefs as the encoder has them (the thesis' way); else `reuse` and `readout` sharpen them, in our mode and
    where the module has an expert for each family."""
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
    families: Path | None = None
    """File of your own families, TOML or Python."""
    law: str | None = None
    """How all tasks are paid: a form's name or a TOML file (docs/reward-laws.md); default is each family's own law."""

    def load(self) -> Trial:
        """Load the parts; RebodyError where an option makes no sense or a part cannot be had."""
        check_agent(self.agent)
        families = read_families(self.families)  # first: artifacts may name its laws
        payment = read_payment(self.law)
        inference, robot = load_inference(self.inference), None
        parts: dict[str, Any] = {"tracker": None}
        if self.robot != POINT_MASS:
            robot = load_robot(self.robot)
            parts |= self._parts(inference, robot)
        return Trial(
            agent=self.agent,
            robot=robot,
            inference=inference,
            families=families,
            slots_by=self._slots_by(inference),
            sharpen=not self.no_sharpen,
            seconds=self.seconds,
            stride=self._fixed_stride(),
            horizon=self.horizon or (1 if self.thesis else HORIZON),
            thesis=self.thesis,
            payment=payment,
            **parts,
        )

    def _parts(self, inference: Inference, spec: RobotSpec) -> dict[str, Any]:
        """What moves a robot: its tracker, and what else the agent needs."""
        module, robot = Path(self.inference).name, spec.name
        parts: dict[str, Any] = {"tracker": load_tracker(_named(self.tracker, tracker_of(spec)))}
        match self.agent:
            case "flat":
                parts["flat"] = load_flat(_named(self.flat, f"flat-{module}-{robot}"))
            case "scratch":
                parts["scratch"] = load_scratch(_named(self.scratch, f"scratch-{robot}"))
            case "retrain":
                parts["high_level"] = load_high_level(_named(self.high_level, f"high-level-{module}-{robot}"))
            case "reuse":
                by_belief = self.classifier is None and self._slots_by(inference) == "belief"
                parts["slots"] = None if by_belief else load_slots_of(inference, self.classifier)
        if self.stride == "predicted":
            parts["step_predictor"] = load_step_predictor(_named(self.step_predictor, f"step-predictor-{robot}"))
        return parts

    def _slots_by(self, inference: Inference) -> SlotsBy:
        if self.slots_by is not None:
            return self.slots_by
        sharpens = not (self.no_sharpen or self.thesis) and inference.can_sharpen
        return "belief" if sharpens and self.classifier is None else "classifier"

    def _fixed_stride(self) -> int:
        """The number, 1 where there is none; RebodyError where nothing can be predicted."""
        if self.stride != "predicted":
            return self.stride
        if not self.thesis:
            raise RebodyError("--stride predicted is of thesis mode: add --thesis, or give a number of decisions.")
        if self.robot == POINT_MASS:
            raise RebodyError("--stride predicted counts control steps of a robot; a point mass has none.")
        return 1


def _named(given: str | None, default: str) -> str:
    return default if given is None else given
