"""`rebody evaluate`."""

from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from rebody.agents.parts import HORIZON, load_inference, load_tracker
from rebody.bodies import load_robot
from rebody.errors import RebodyError
from rebody.evaluation import evaluate, save_results, summary_table
from rebody.evaluation.evaluate import POINT_MASS, Trial
from rebody.tasks.task_file import read_tasks


@dataclass(frozen=True)
class Evaluate:
    """Judge an agent on a file of hidden tasks: table, and JSON with every decision."""

    tasks: Path
    """Task file: [{"family": "goal", "target": -9.0}, ...]."""
    robot: str = "cheetah"
    """Body (see `rebody list`)."""
    inference: str = "position"
    """Inference artifact: a shipped name or a folder."""
    agent: str = "reuse"
    """reuse, oracle (told the task) or idle (knows nothing and stands still)."""
    tracker: str | None = None
    """Tracker artifact; default tracker-ROBOT."""
    seeds: int = 1
    """Every task once per evaluation seed 0 to N-1."""
    seconds: float = 20.0
    """Length of an episode."""
    stride: int = 1
    """Decisions for which a subgoal is held."""
    horizon: int = HORIZON
    """Decisions that `reuse` looks ahead; 1 is the thesis."""
    json: Path | None = None
    """Where the JSON goes."""

    def run(self) -> None:
        """Evaluate, save, print the table."""
        for name, least in (("seeds", 1), ("stride", 1), ("horizon", 1)):
            if getattr(self, name) < least:
                raise RebodyError(f"--{name} must be at least {least}.")
        specs = read_tasks(self.tasks)
        trial = make_trial(
            self.robot, self.agent, self.inference, self.tracker, self.seconds, self.stride, self.horizon
        )
        console = Console()
        with console.status(f"{len(specs) * self.seeds} episodes of {self.seconds:g} s"):
            results = evaluate(trial, specs, self.seeds)
        if self.json is not None:
            save_results(results, self.json)
        console.print(summary_table([results]))


def make_trial(
    robot: str,
    agent: str,
    inference: str,
    tracker: str | None,
    seconds: float = 20.0,
    stride: int = 1,
    horizon: int = HORIZON,
) -> Trial:
    """Load what a trial needs."""
    on_toy = robot == POINT_MASS
    return Trial(
        agent=agent,
        robot=None if on_toy else load_robot(robot),
        inference=load_inference(inference),
        tracker=None if on_toy else load_tracker(tracker or f"tracker-{robot}"),
        seconds=seconds,
        stride=stride,
        horizon=horizon,
    )
