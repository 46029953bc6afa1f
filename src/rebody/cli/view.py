"""`rebody view`: the live page."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro
from rich.console import Console

from rebody.bodies import shipped_robots
from rebody.cli.trial import AGENT_HELP, TrialOptions
from rebody.errors import RebodyError
from rebody.evaluation.trial import POINT_MASS, Trial, check_trial
from rebody.ranges import Port
from rebody.store import shipped_artifacts
from rebody.tasks.task_file import TaskSpec, parse_task

if TYPE_CHECKING:
    from rebody.viewer.controls import Choice

FIRST = TaskSpec("goal", (4.0,))
"""Hidden at first where the module knows it."""


@dataclass(frozen=True)
class View:
    """Watch a robot find out its hidden task in a browser, change the task, push the robot."""

    robot: str = TrialOptions.robot
    """Body that is shown first."""
    inference: str = TrialOptions.inference
    """Inference artifact that is heard first."""
    agent: Annotated[str, tyro.conf.arg(help=AGENT_HELP)] = TrialOptions.agent
    task: str | None = None
    """Hidden task at first: FAMILY=TARGET, such as goal=-9, or place=3,-2; default is one that the module knows."""
    tracker: str | None = None
    """Tracker artifact of that robot; default tracker-ROBOT."""
    flat: str | None = None
    """Flat policy of that robot and module; default flat-INFERENCE-ROBOT."""
    classifier: str | None = None
    """Classifier of that module; default classifier-INFERENCE."""
    families: Path | None = None
    """File of your own families, TOML or Python."""
    port: Port = 8080
    """Where on this machine the page is; 0 for any free port."""

    def run(self) -> None:
        """Show the page until Ctrl-C; RebodyError where parts do not fit or the extra is missing."""
        try:
            from rebody.viewer.controls import Choice, Offered
            from rebody.viewer.page import Page
            from rebody.viewer.server import serving
            from rebody.viewer.session import fitting
        except ModuleNotFoundError as error:
            if error.name not in ("viser", "mjviser"):
                raise
            raise RebodyError("the live page needs more packages: install with `pip install 'rebody[view]'`.") from None
        choice = Choice(self.robot, self.inference, self.agent)
        trial = self._load(choice)
        task = fitting(trial, FIRST) if self.task is None else parse_task(self.task, trial.in_play)
        check_trial(trial, [task])
        modules = [name for name, kind in shipped_artifacts() if kind == "inference"]
        offered = Offered(_with([POINT_MASS, *shipped_robots()], self.robot), _with(modules, self.inference))
        with serving(self.port) as server:
            Console().print("Open that address in a browser. Ctrl-C ends the page.")
            Page(server, offered, self._load, choice, trial, task).run()

    def _load(self, choice: "Choice") -> Trial:
        """What was chosen on the page; parts that were named are of the robot and the module that were named."""
        of_robot = choice.robot == self.robot
        of_module = choice.inference == self.inference
        return TrialOptions(
            robot=choice.robot,
            inference=choice.inference,
            agent=choice.agent,
            tracker=self.tracker if of_robot else None,
            flat=self.flat if of_robot and of_module else None,
            classifier=self.classifier if of_module else None,
            families=self.families,
        ).load()


def _with(shipped: list[str], own: str) -> list[str]:
    """The shipped names and one's own."""
    return [*shipped, *([] if own in shipped else [own])]
