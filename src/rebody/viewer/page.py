"""The page: a session in real time, shown to and meddled with by all browsers that look."""

import logging
import queue
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import viser

from rebody.errors import RebodyError
from rebody.evaluation.trial import Trial, check_trial
from rebody.tasks.task_file import TaskSpec
from rebody.viewer import words
from rebody.viewer.controls import Choice, Controls, Offered, Order, Push, Restart
from rebody.viewer.pace import Pace
from rebody.viewer.panel import BeliefPanel
from rebody.viewer.scene import Scene
from rebody.viewer.session import Moment, Session, fitting

CONTROLS_PX = 320
"""Width of the panel of controls."""
FRAME_S, LATENT_S = 1 / 40, 0.25
"""Real seconds from one picture of the body, and of the latent, to the next."""
STEADY_S = 1.0
"""A session that fails before this simulated time [s] would fail again after a restart."""
AGAIN = "The robot is back at the start."
PAUSED = "It failed straight after a start, so the page is paused. Choose another task or robot, then press Go on."


class Page:
    """Runs a session; all happens in the thread of `run`, which takes orders from the controls."""

    def __init__(
        self,
        server: viser.ViserServer,
        offered: Offered,
        load: Callable[[Choice], Trial],
        choice: Choice,
        trial: Trial,
        task: TaskSpec,
    ):
        """`load` fetches what is chosen among what is offered; choice, trial and task are those to begin with."""
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        server.gui.main_panel.dock_right()
        server.gui.main_panel.set_width(CONTROLS_PX)
        self.controls = Controls(server.gui, offered, choice)
        self.controls.show_task(trial, task)
        self._panel = BeliefPanel(server.gui, trial)
        self._server, self._load, self._offered = server, load, offered
        self._ended = threading.Event()
        self._first = (choice, trial, task)

    def run(self) -> None:
        """Until `end` is called; time stands still while nobody looks."""
        choice, trial, task = self._first
        self.controls.show_status(words.loading(choice.robot))
        self._watch(choice, Session(trial, task))
        while not self._ended.wait(FRAME_S):
            self._obey()
            if self._server.get_clients():
                self._go_on()
            else:
                self._pace.wait(time.monotonic())

    def end(self) -> None:
        """Let `run` return; any thread may call this."""
        self._ended.set()

    def _watch(self, choice: Choice, session: Session) -> None:
        """Show that session, in place of the one before."""
        self._scene = Scene(self._server, session.body, session.trial.in_play, session.is_in_plane)
        self._panel.listen_to(session.trial)
        self.controls.show_task(session.trial, session.task)
        self._choice, self.session = choice, session
        self._begin()

    def _begin(self) -> None:
        """What is remembered of an episode, at its start."""
        self._pace = Pace(self.session.body.step_s, time.monotonic())
        self._seen: tuple[Moment | None, TaskSpec] | None = None
        self._drawn: Moment | None = None
        self._latent_due = 0.0

    def _obey(self) -> None:
        """Do what was clicked; what cannot be done is said on the page, and the controls go back to what is."""
        for order in _waiting(self.controls.orders):
            try:
                self._carry_out(order)
            except Exception as error:
                self._complain(error)
                self.controls.show_choice(self._choice)
                self.controls.show_task(self.session.trial, self.session.task)

    def _carry_out(self, order: Order) -> None:
        match order:
            case Choice():
                self._change_to(order)
            case TaskSpec():
                self.session.set_task(order)
                self.controls.show_task(self.session.trial, order)
            case Push(change, axis):
                self.session.push(change, axis)
            case Restart():
                self.session.restart()
                self._begin()
            case RebodyError():
                raise order

    def _change_to(self, choice: Choice) -> None:
        self.controls.show_status(words.loading(choice.robot))
        choice, trial = self._fitting(choice)
        session = Session(trial, fitting(trial, self.session.task))
        self.controls.show_choice(choice)
        try:
            self._watch(choice, session)
        except Exception:  # it cannot be drawn
            self._watch(self._choice, self.session)
            raise

    def _fitting(self, choice: Choice) -> tuple[Choice, Trial]:
        """The choice and its parts; where the new one of robot and module does not go with the other, that changes too.

        RebodyError where nothing that is offered goes with it.
        """
        try:
            return choice, self._checked(choice)
        except RebodyError:
            for other in self._alternatives(choice):
                with suppress(RebodyError):
                    return other, self._checked(other)
            raise

    def _alternatives(self, choice: Choice) -> list[Choice]:
        new_robot, new_module = choice.robot != self._choice.robot, choice.inference != self._choice.inference
        if new_robot == new_module:
            return []
        if new_robot:
            return [replace(choice, inference=name) for name in self._offered.inferences]
        return [replace(choice, robot=name) for name in self._offered.robots]

    def _checked(self, choice: Choice) -> Trial:
        trial = self._load(choice)
        check_trial(trial, [fitting(trial, self.session.task)])
        return trial

    def _go_on(self) -> None:
        """Simulate and show; the page outlives whatever goes wrong in a session."""
        try:
            self._advance(time.monotonic())
            self._show(time.monotonic())
        except Exception as error:
            self._recover(error)

    def _recover(self, error: Exception) -> None:
        """From the start after a fault; paused where that would fail again, for ever."""
        if self.controls.paused:  # nothing is simulated: it was said before
            return
        hopeless = self.session.time_s < STEADY_S
        try:
            self._carry_out(Restart())
        except Exception as second:
            error, hopeless = second, True
        self._complain(error, PAUSED if hopeless else AGAIN)
        if hopeless:
            self.controls.pause()

    def _advance(self, now: float) -> None:
        """Simulate what is due."""
        if self.controls.paused:
            self._pace.wait(now)
            return
        for _ in range(self._pace.due(now, self.controls.speed)):
            self.session.step()

    def _show(self, now: float) -> None:
        """Bring the page up to date with the session."""
        session = self.session
        pose, where = session.between(self._pace.share)
        moment = session.moments[-1] if session.moments else None
        self._scene.show_body(pose, where)
        self._scene.show_marks(session.task, moment, where)
        self.controls.show_status(words.status(session, self._pace.reached, self.controls.paused))
        if (moment, session.task) != self._seen:
            self._seen = (moment, session.task)
            self._panel.show(session)
        if moment is not self._drawn and now >= self._latent_due:
            self._drawn, self._latent_due = moment, now + LATENT_S
            self._panel.show_latent([*session.moments])

    def _complain(self, error: Exception, then: str = "") -> None:
        """Say on all open pages what went wrong; what is no fault of a user is logged, too."""
        says = str(error)
        if not isinstance(error, RebodyError):
            logging.getLogger(__name__).error("the live page goes on after:", exc_info=error)
            says = f"An unexpected error ({type(error).__name__}: {error}); the terminal shows where."
        for client in self._server.get_clients().values():
            client.add_notification(
                "This does not work", f"{says} {then}".strip(), color="red", auto_close_seconds=12.0
            )


def _waiting(orders: queue.SimpleQueue[Order]) -> list[Order]:
    """All that wait; of choices only the last, since each takes seconds to load."""
    waiting: list[Order] = []
    while not orders.empty():
        waiting.append(orders.get())
    choices = [order for order in waiting if isinstance(order, Choice)]
    return [order for order in waiting if not isinstance(order, Choice) or order is choices[-1]]
