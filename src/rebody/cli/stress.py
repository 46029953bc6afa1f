"""`rebody stress`."""

from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from rebody.agents.build import check_robot_of
from rebody.agents.parts import load_tracker, tracker_of
from rebody.bodies import load_robot
from rebody.evaluation.stress import CHANGE_S, PUSH, PUSH_S, SECONDS, stress
from rebody.ranges import Episodes, NotNegative, Seed
from rebody.tasks.family_file import read_families


@dataclass(frozen=True)
class Stress:
    """Random subgoals and pushes: how often does a robot's tracker let it fall?"""

    robot: str = "hopper"
    """A robot's name (see `rebody list`), or the path of its TOML file."""
    tracker: str | None = None
    """Tracker artifact; default tracker-ROBOT, or the navigator for a robot that walks by a policy of its own."""
    families: Path | None = None
    """File of your own families, where the tracker knows any with a reward law of your own."""
    episodes: Episodes = 1000
    """How many times."""
    push: NotNegative = PUSH
    """What a push adds to the speed of every part [m/s]."""
    seed: Seed = 0
    """Seed of subgoals and pushes."""

    def run(self) -> None:
        """Run them all at once, print what share fell."""
        read_families(self.families)  # artifacts may name its laws
        spec = load_robot(self.robot)
        loaded = load_tracker(tracker_of(spec) if self.tracker is None else self.tracker)
        check_robot_of(loaded, spec)
        console = Console()
        with console.status(f"{self.episodes} episodes of {SECONDS:g} s"):
            result = stress(loaded.tracker, spec, self.episodes, self.seed, self.push)
        way = "in any direction" if spec.floats_freely else "one way or the other"
        console.print(
            f"{spec.name}, {loaded.name}: subgoals changed every {CHANGE_S[0]:g} to {CHANGE_S[1]:g} s, pushed by "
            f"{self.push:g} m/s {way} every {PUSH_S[0]:g} to {PUSH_S[1]:g} s, {SECONDS:g} s:\n"
            f"fallen in {int(result.fell.sum())} of {self.episodes} episodes ({100 * result.fell.mean():.1f} %), "
            f"lying at the end {int(result.ended_lying.sum())}.",
            highlight=False,
        )
