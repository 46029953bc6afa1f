"""`rebody run`: one episode, to look at."""

from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from rebody.agents.parts import HORIZON
from rebody.cli.evaluate import make_trial
from rebody.errors import RebodyError
from rebody.evaluation import evaluate
from rebody.evaluation.evaluate import POINT_MASS, Trial
from rebody.evaluation.results import EpisodeResult
from rebody.report import film, plot_episode
from rebody.tasks.task_file import TaskSpec, parse_task


@dataclass(frozen=True)
class RunTask:
    """Run one episode on a hidden task; say how it went, draw it, film it."""

    task: str
    """FAMILY=TARGET, such as goal=-9."""
    robot: str = "cheetah"
    """Body (see `rebody list`)."""
    inference: str = "position"
    """Inference artifact: a shipped name or a folder."""
    agent: str = "reuse"
    """reuse, oracle (told the task) or idle (knows nothing and stands still)."""
    tracker: str | None = None
    """Tracker artifact; default tracker-ROBOT."""
    seconds: float = 20.0
    """Length of the episode."""
    stride: int = 1
    """Decisions for which a subgoal is held."""
    horizon: int = HORIZON
    """Decisions that `reuse` looks ahead; 1 is the thesis."""
    video: Path | None = None
    """Where an MP4 goes."""
    figure: Path | None = None
    """Where a PNG goes."""

    def run(self) -> None:
        """Run the episode and print its end."""
        spec = parse_task(self.task)
        if self.video is not None and self.robot == POINT_MASS:
            raise RebodyError("there is no video of a point mass; use --figure.")
        trial = make_trial(
            self.robot, self.agent, self.inference, self.tracker, self.seconds, self.stride, self.horizon
        )
        episode = evaluate(trial, [spec], 1).episodes[0] if self.video is None else shoot(trial, spec, self.video)
        if self.figure is not None:
            plot_episode(episode, self.figure)
        Console().print(describe(episode), highlight=False)


def shoot(trial: Trial, spec: TaskSpec, path: Path) -> EpisodeResult:
    """Film an episode with a progress bar."""
    with Progress(console=Console(stderr=True), transient=True) as progress:
        bar = progress.add_task(f"filming {path.name}", total=1.0)
        return film(trial, spec, path, lambda done: progress.update(bar, completed=done))


def describe(episode: EpisodeResult) -> str:
    """One line about how it ended."""
    fell = ", fell" if episode.fell else ""
    return (
        f"hidden {episode.active_family[-1]} {episode.active_target[-1]:g}: "
        f"read from the belief {episode.inferred_target[-1]:.2f}, final error {episode.final_error:.3f}{fell}"
    )
