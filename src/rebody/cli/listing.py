"""`rebody list`."""

from dataclasses import dataclass

from rich.console import Console
from rich.table import Table

from rebody.agents.build import AGENTS
from rebody.bodies import shipped_robots
from rebody.evaluation.evaluate import POINT_MASS
from rebody.report.thesis import FIGURES
from rebody.store import load_artifact, shipped_artifacts
from rebody.tasks import FAMILIES
from rebody.training.inference import PRESETS


@dataclass(frozen=True)
class List:
    """Bodies, task families, agents, presets, shipped artifacts and figures."""

    def run(self) -> None:
        """Print them."""
        table = Table(show_header=False, box=None, padding=(0, 2))
        for name in (POINT_MASS, *shipped_robots()):
            table.add_row("body", name, "the toy" if name == POINT_MASS else "MuJoCo robot")
        for family in FAMILIES:
            table.add_row("family", family.name, f"{family.unit}, solved within {family.tolerance:g}")
        for name, what in AGENTS.items():
            table.add_row("agent", name, what)
        for name, preset in PRESETS.items():
            table.add_row("preset", name, (preset.__doc__ or "").splitlines()[0])
        for name, kind in shipped_artifacts():
            title = load_artifact(name, kind).card.splitlines()[0].lstrip("# ")
            table.add_row("artifact", name, title)
        for number, figure in FIGURES.items():
            table.add_row("figure", number, figure.title)
        Console().print(table)
