"""The picture of a diagnosis."""

from pathlib import Path
from textwrap import fill

from rebody.evaluation.diagnosis import EXACT, LADDER, Diagnosis
from rebody.report.figures import draw_errors
from rebody.report.style import BELIEF, IDLE, MOTION, ORACLE, as_text, figure

COLOURS = dict(zip((*LADDER, "idle", EXACT), (ORACLE, IDLE, BELIEF, MOTION, "#9a9a9a", "#588b8b"), strict=True))


def plot_diagnosis(diagnosis: Diagnosis, path: Path) -> None:
    """Left: the return that each part costs. Then, per family, the errors as parts are added, sorted."""
    families = diagnosis.families
    with figure(path, 1, 1 + len(families), size=(4.5 * (1 + len(families)), 4.2)) as (drawing, (costs, *errors)):
        lost = [-cost for cost in diagnosis.lost().values()]
        costs.barh(
            [fill(part, 32) for part in diagnosis.ladder.values()], lost, color=[COLOURS[a] for a in diagnosis.ladder]
        )
        costs.invert_yaxis()
        costs.set(xlabel="return that it costs", title="what each part costs")
        for axes, family in zip(errors, families, strict=True):
            for agent, results in diagnosis.results.items():
                draw_errors(axes, results.of(family.name), label=agent, color=COLOURS[agent])
            axes.set(xlabel=f"{family.name}: final error [{family.unit}]", ylabel="episodes [%]")
        reuse = diagnosis.results["reuse"]
        drawing.suptitle(f"'{as_text(reuse.inference)}' on {as_text(reuse.robot)}: which part lost what")
