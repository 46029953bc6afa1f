"""The picture of a diagnosis."""

from pathlib import Path

import numpy as np

from rebody.evaluation.diagnosis import LADDER, Diagnosis
from rebody.report.style import BELIEF, IDLE, MOTION, ORACLE, figure
from rebody.tasks import FAMILIES

COLOURS = dict(zip(LADDER, (ORACLE, IDLE, BELIEF, MOTION), strict=True))


def plot_diagnosis(diagnosis: Diagnosis, path: Path) -> None:
    """Left: the return that each part costs. Then, per family, the errors as parts are added, sorted."""
    families = [f for f in FAMILIES if f.name in diagnosis.results["reuse"].summary["families"]]
    with figure(path, 1, 1 + len(families), size=(4.5 * (1 + len(families)), 4.2)) as (drawing, (costs, *errors)):
        costs.barh(list(LADDER.values()), [-cost for cost in diagnosis.lost().values()], color=list(COLOURS.values()))
        costs.invert_yaxis()
        costs.set(xlabel="return that it costs", title="what each part costs")
        for axes, family in zip(errors, families, strict=True):
            for agent, results in diagnosis.results.items():
                of = [e.final_error for e in results.episodes if e.active_family[-1] == family.name]
                share = 100 * np.arange(1, len(of) + 1) / len(of)
                axes.step(np.maximum(np.sort(of), 1e-3), share, where="post", color=COLOURS[agent], label=agent)
            axes.set(xscale="log", xlabel=f"{family.name}: final error [{family.unit}]", ylabel="episodes [%]")
            axes.legend(frameon=False)
        reuse = diagnosis.results["reuse"]
        drawing.suptitle(f"'{reuse.inference}' on {reuse.robot}: which part lost what")
