"""Options that all commands share which put an agent to the test."""

import math
from dataclasses import dataclass

from rebody.agents.parts import HORIZON, load_inference, load_tracker
from rebody.bodies import load_robot
from rebody.errors import RebodyError
from rebody.evaluation.evaluate import POINT_MASS, Trial


@dataclass(frozen=True)
class TrialOptions:
    """Who is put to the test, and where."""

    robot: str = "cheetah"
    """Body (see `rebody list`)."""
    inference: str = "position"
    """Inference artifact: a shipped name or a folder."""
    agent: str = "reuse"
    """reuse, oracle (told the task) or idle (knows nothing and stands still)."""
    tracker: str | None = None
    """Tracker artifact; default tracker-ROBOT."""
    seconds: float = 20.0
    """Length of an episode."""
    stride: int = 1
    """Decisions for which a subgoal is held."""
    horizon: int = HORIZON
    """Decisions that `reuse` looks ahead; 1 is the thesis."""

    def load(self) -> Trial:
        """Load the parts; RebodyError where an option makes no sense or a part cannot be had."""
        for name in ("stride", "horizon"):
            if getattr(self, name) < 1:
                raise RebodyError(f"--{name} must be at least 1.")
        if not math.isfinite(self.seconds):
            raise RebodyError(f"--seconds must be finite, not {self.seconds:g}.")
        on_toy = self.robot == POINT_MASS
        return Trial(
            agent=self.agent,
            robot=None if on_toy else load_robot(self.robot),
            inference=load_inference(self.inference),
            tracker=None if on_toy else load_tracker(self.tracker or f"tracker-{self.robot}"),
            seconds=self.seconds,
            stride=self.stride,
            horizon=self.horizon,
        )
