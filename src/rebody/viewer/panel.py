"""The panel beside the scene: what is believed, in numbers, over time, and in the latent."""

from collections.abc import Sequence

import viser

from rebody.evaluation.trial import Trial
from rebody.viewer import words
from rebody.viewer.latent import LatentPicture
from rebody.viewer.map import draw_map
from rebody.viewer.plots import ProbabilityPlot, ReachedPlot
from rebody.viewer.session import Moment, Session

PANEL_PX = 340
"""Its width."""


class BeliefPanel:
    """Numbers, a map where there is a plane, two plots over time, and the latent; a second tab explains it all."""

    def __init__(self, gui: viser.GuiApi, trial: Trial):
        panel = gui.add_panel()
        self._gui = gui
        self._tab = panel.add_tab("What it believes")
        with self._tab:
            self._numbers = gui.add_html("")
            self._map = gui.add_html("")
        self._listen_to(trial)
        with panel.add_tab("What you see"):
            self._guide = gui.add_markdown(words.guide(trial.inference.contract.families))
        panel.dock_left()
        panel.set_width(PANEL_PX)

    def listen_to(self, trial: Trial) -> None:
        """Show the beliefs of a trial's module from now on."""
        if trial.inference is not self._inference or trial.in_play != self._known:
            for part in (self._reached, self._families, self._probabilities, self._latent):
                part.remove()
            self._listen_to(trial)
            self._guide.content = words.guide(trial.inference.contract.families)

    def show(self, session: Session) -> None:
        """All but the latent."""
        task, moments = session.task, [*session.moments]
        self._map.content = draw_map(session) if session.is_in_plane else ""
        self._numbers.content = words.numbers(self._known, task, moments[-1] if moments else None)
        self._reached.show(moments, self._known.named(task.family))
        self._probabilities.show(moments)

    def show_latent(self, moments: Sequence[Moment]) -> None:
        """The latent, which takes the longest to draw."""
        picture = self._picture.draw([moment.reading for moment in moments])
        self._latent.content = words.picture(picture, "The latent, and the clusters in it")

    def _listen_to(self, trial: Trial) -> None:
        families, parts = trial.inference.contract.families, trial.inference.parts
        self._inference, self._known = trial.inference, trial.in_play
        self._picture = LatentPicture(parts.module.encoder.prior().mean.shape[-1], parts.mixture, families)
        with self._tab:
            self._reached = ReachedPlot(self._gui, self._known)
            self._families = self._gui.add_html(words.family_legend(families))
            self._probabilities = ProbabilityPlot(self._gui, families)
            self._latent = self._gui.add_html("")
        self.show_latent([])
