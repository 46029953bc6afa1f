"""The panel beside the scene: what is believed, in numbers, over time, and in the latent."""

from collections.abc import Sequence

import viser

from rebody.evaluation.evaluate import Trial
from rebody.tasks.task_file import TaskSpec
from rebody.viewer import words
from rebody.viewer.latent import LatentPicture
from rebody.viewer.plots import ProbabilityPlot, ReachedPlot
from rebody.viewer.session import Moment

WIDTH = 340
"""Of the panel in pixels."""


class BeliefPanel:
    """Numbers, two plots over time, and the latent; a second tab explains it all."""

    def __init__(self, gui: viser.GuiApi, trial: Trial):
        self._panel = gui.add_panel()
        families = tuple(trial.inference.contract.target_ranges)
        parts = trial.inference.parts
        latent = parts.module.encoder.prior().mean.shape[-1]
        with self._panel.add_tab("What it believes"):
            self._legend = gui.add_html("")
            self._reached = ReachedPlot(gui)
            self._families = gui.add_html(words.family_legend(families))
            self._probabilities = ProbabilityPlot(gui, families)
            self._picture = LatentPicture(latent, parts.mixture)
            self._latent = gui.add_image(self._picture.draw([]), format="png")
        with self._panel.add_tab("What you see"):
            gui.add_markdown(words.GUIDE)
        self._panel.dock_left()
        self._panel.set_width(WIDTH)

    def show(self, task: TaskSpec, moments: Sequence[Moment]) -> None:
        """All but the latent."""
        self._legend.content = words.legend(task, moments[-1] if moments else None)
        self._reached.show(moments, task.family)
        self._probabilities.show(moments)

    def show_latent(self, moments: Sequence[Moment]) -> None:
        """The latent, which takes the longest to draw."""
        self._latent.image = self._picture.draw([moment.reading for moment in moments])

    def remove(self) -> None:
        """Another module believes other things."""
        self._panel.remove()
