"""A page of everything, from evaluations of a tiny agent, a tiny artifact, a picture and a film."""

import warnings
from dataclasses import dataclass
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest

from rebody.evaluation import Results, save_results
from rebody.evaluation.diagnosis import diagnose
from rebody.report import plot_episode
from rebody.report.page import find, write_page
from rebody.store import save_artifact
from rebody.tasks.task_file import Switch, TaskSpec

CARD = """# Tracker: tiny

Hears of `goals` & <b>speeds</b>. ![a picture](https://example.org/picture.png)

| figure | value |
|---|---|
| goal median | 0.125 m |
"""
LOG = """iteration,critic_loss,actor_loss,evaluation/goal median,evaluation/goal p95,novelty
1,0.5,-1,,,3
2,0.25,-2,0.5,0.9,2
3,0.125,-3,0.125,0.4,1
"""
CONFIG = {
    "robot": "cheetah",
    "reach": {"speed": [-3.0, 3.0], "pitch": None},
    "training": {"sac": {"learning_rate": 3e-4, "hidden": [8, 8]}, "pushed": True},
}


@dataclass(frozen=True)
class Written:
    """The page, and what it was made from."""

    path: Path
    artifact: Path
    demo: Path
    results: dict[str, Results]

    @property
    def text(self) -> str:
        return self.path.read_text()


@pytest.fixture(scope="session")
def artifact(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("artifacts") / "tiny-tracker"
    return save_artifact(folder, kind="tracker", config=CONFIG, weights={"w": np.ones(2)}, card=CARD, log=LOG)


@pytest.fixture(scope="session")
def written(trial, artifact, tmp_path_factory) -> Written:
    """One page of a tracker and of a folder with a diagnosis, a figure and a film."""
    demo = tmp_path_factory.mktemp("page") / "demo"
    tasks = [TaskSpec("goal", (2.5,)), TaskSpec("goal", (-1.0,), Switch(1.0, "goal", (1.5,)))]
    results = diagnose(trial, tasks, 1, lambda agent: None).results
    for agent, of in results.items():
        save_results(of, demo / f"{agent}.json")
    (demo / "tasks.json").write_text('[{"family": "goal", "target": 2.5}]')
    plot_episode(results["reuse"].episodes[0], demo / "episode.png")
    _film(demo / "episode.mp4")
    path = demo.with_name("report.html")
    write_page([find(str(artifact)), find(str(demo))], path)
    return Written(path, artifact, demo, results)


def _film(path: Path) -> None:
    """A few grey frames."""
    writer = imageio_ffmpeg.write_frames(str(path), (64, 64), fps=10)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=r"os\.fork\(\) was called")
        writer.send(None)
    for shade in range(0, 250, 50):
        writer.send(np.full((64, 64, 3), shade, np.uint8))
    writer.close()
