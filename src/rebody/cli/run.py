"""`rebody run`: one episode, to look at."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console
from rich.progress import Progress

from rebody.cli.output import PICTURES, check_output
from rebody.cli.trial import TrialOptions
from rebody.errors import RebodyError
from rebody.evaluation import evaluate
from rebody.evaluation.episode import EpisodeResult
from rebody.evaluation.listening import listen_beside
from rebody.evaluation.trial import Trial
from rebody.report import film, plot_episode
from rebody.report.page.tables import vector
from rebody.tasks.task_file import TaskSpec, parse_task


@dataclass(frozen=True)
class RunTask:
    """Run one episode on a hidden task; say how it went, draw it, film it."""

    task: str
    """FAMILY=TARGET, such as goal=-9, or place=3,-2 where a target has several numbers."""
    video: Path | None = None
    """Where an MP4 goes."""
    figure: Path | None = None
    """Where a PNG goes."""
    trial: Annotated[TrialOptions, tyro.conf.arg(name="")] = field(default_factory=TrialOptions)

    def run(self) -> None:
        """Run the episode and print its end."""
        check_output(self.figure, "--figure", PICTURES)
        check_output(self.video, "--video", (".mp4",))
        trial = self.trial.load()
        spec = parse_task(self.task, trial.in_play)
        if self.video is not None and trial.robot is None:
            raise RebodyError("there is no video of a point mass; use --figure.")
        episode = evaluate(trial, [spec], 1).episodes[0] if self.video is None else shoot(trial, spec, self.video)
        if self.figure is not None:
            plot_episode(episode, self.figure, listen_beside(trial, episode))
        Console().print(describe(episode), highlight=False)


def shoot(trial: Trial, spec: TaskSpec, path: Path) -> EpisodeResult:
    """Film an episode with a progress bar."""
    with Progress(console=Console(stderr=True), transient=True) as progress:
        bar = progress.add_task(f"filming {path.name}", total=1.0)
        return film(trial, spec, path, lambda done: progress.update(bar, completed=done))


def describe(episode: EpisodeResult) -> str:
    """One line about how it ended."""
    fell = ", fell" if episode.fell else ""
    hidden, read = vector(episode.active_target[-1], "g"), vector(episode.inferred_target[-1], ".2f")
    return (
        f"hidden {episode.active_family[-1]} {hidden}: "
        f"read from the belief {read}, final error {episode.final_error:.3f}{fell}"
    )
