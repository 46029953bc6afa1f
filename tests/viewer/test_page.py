"""The page in a real browser, and what may go wrong around it."""

import io
import shutil
import socket
import sys
import threading
import time
from collections.abc import Callable
from contextlib import contextmanager
from typing import ClassVar

import numpy as np
import pytest
from PIL import Image

from rebody.cli.main import run
from rebody.cli.trial import TrialOptions
from rebody.tasks.task_file import TaskSpec

viser = pytest.importorskip("viser")
pytest.importorskip("mjviser")
from rebody.viewer.controls import Choice, Offered, Push, Restart  # noqa: E402
from rebody.viewer.page import Page  # noqa: E402
from rebody.viewer.server import serving  # noqa: E402

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
# WebGL without a graphics card
SOFTWARE = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
FIRST = Choice("cheetah", "goal-velocity", "reuse")
PATIENCE_S = 120.0
"""For a slow machine that has other work."""


def load(choice: Choice):
    return TrialOptions(robot=choice.robot, inference=choice.inference, agent=choice.agent).load()


@contextmanager
def shown(task: TaskSpec):
    """A page that runs in a thread of its own, and its address."""
    offered = Offered(["point-mass", "cheetah"], ["position", "goal-velocity", "goal-velocity-stand"])
    with serving(0) as server:
        page = Page(server, offered, load, FIRST, load(FIRST), task)
        thread = threading.Thread(target=page.run)
        thread.start()
        try:
            yield page, f"http://127.0.0.1:{server.get_port()}"
        finally:
            page.end()
            thread.join()


def wait_for(condition: Callable[[], bool], what: str) -> None:
    began = time.monotonic()
    while not condition():
        assert time.monotonic() - began < PATIENCE_S, f"waited in vain: {what}"
        time.sleep(0.05)


@pytest.fixture(scope="module")
def browser():
    sync_api = pytest.importorskip("playwright.sync_api")
    if CHROMIUM is None:
        pytest.skip("no chromium")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=SOFTWARE)
        yield browser
        browser.close()


def open_tab(browser, address: str, errors: list[str]):
    tab = browser.new_page(viewport={"width": 1366, "height": 650})
    tab.set_default_timeout(1000 * PATIENCE_S)
    tab.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
    tab.on("pageerror", lambda error: errors.append(str(error)))
    tab.goto(address)
    return tab


def brown_pixels(tab) -> int:
    """Of the colour of a cheetah, in the middle of the page."""
    picture = Image.open(io.BytesIO(tab.screenshot(clip={"x": 480, "y": 300, "width": 420, "height": 160})))
    red, _, blue = np.moveaxis(np.asarray(picture.convert("RGB")).astype(int), -1, 0)
    return int((red - blue > 25).sum())


def test_in_a_browser_the_belief_follows_a_change_of_the_task(browser):
    errors: list[str] = []
    with shown(TaskSpec("goal", (2.0,))) as (page, address):
        tab = open_tab(browser, address, errors)
        tab.get_by_text("What it believes").wait_for()
        tab.get_by_text("x real time").wait_for()
        tab.get_by_role("row", name="hidden task goal +2.00 m").wait_for()
        assert tab.locator(".uplot").count() == 2
        assert tab.locator("img[alt^='The latent']").evaluate("image => image.naturalWidth") > 500
        wait_for(lambda: brown_pixels(tab) > 2000, "the robot in the scene")

        tab.get_by_label("Kind", exact=True).click()
        tab.get_by_role("option", name="velocity", exact=True).click()
        tab.get_by_text("Change the task now").click()
        tab.get_by_role("row", name="hidden task velocity +1.50 m/s").wait_for()
        wait_for(lambda: page.session.moments[-1].reading.family == "velocity", "the belief")
        wait_for(lambda: abs(page.session.moments[-1].reading.target[0] - 1.5) < 0.2, "the believed speed")
        tab.get_by_role("row", name="believed velocity +1.").wait_for()

        # a closed tab stops the time, a new one finds all as it was
        tab.close()
        time.sleep(1.0)
        stood = page.session.time_s
        time.sleep(0.5)
        assert page.session.time_s == stood
        tab = open_tab(browser, address, errors)
        tab.get_by_role("row", name="hidden task velocity +1.50 m/s").wait_for()
        wait_for(lambda: page.session.time_s > stood, "time to go on")
    assert not errors


@pytest.fixture
def looked_at(monkeypatch):
    """The page believes that somebody looks."""
    monkeypatch.setattr(viser.ViserServer, "get_clients", lambda _: {0: Onlooker()})
    monkeypatch.setattr(Onlooker, "heard", [])


class Onlooker:
    """Stands for a browser."""

    heard: ClassVar[list[str]] = []

    def add_notification(self, title: str, body: str, **_: object) -> None:
        self.heard.append(body)


def test_orders_are_carried_out(looked_at):
    with shown(TaskSpec("goal", (2.0,))) as (page, _):
        orders = page.controls.orders
        wait_for(lambda: hasattr(page, "session") and page.session.time_s > 0.3, "the start")
        orders.put(TaskSpec("velocity", (-1.0,)))
        wait_for(lambda: page.session.task == TaskSpec("velocity", (-1.0,)), "the task")

        cheetah = page.session
        orders.put(Choice("point-mass", "goal-velocity-stand", "oracle"))
        wait_for(lambda: page.session is not cheetah, "another session")
        assert page.session.trial.robot is None
        assert page.session.task == TaskSpec("velocity", (-1.0,))

        orders.put(TaskSpec("goal", (0.0,)))
        orders.put(Restart())
        wait_for(lambda: page.session.task.family == "goal", "the task")
        before = page.session.x
        orders.put(Push(1.0))
        wait_for(lambda: page.session.x > before + 0.05, "the push")


def test_what_does_not_fit_is_said_and_all_goes_on(looked_at):
    with shown(TaskSpec("goal", (2.0,))) as (page, _):
        wait_for(lambda: hasattr(page, "session"), "the start")
        session = page.session
        page.controls.orders.put(Choice("walker", "goal-velocity-stand", "idle"))
        wait_for(lambda: bool(Onlooker.heard), "a complaint")
        assert "the tracker has no slot for stand" in Onlooker.heard[0]
        stood = page.session.time_s
        assert page.session is session
        wait_for(lambda: session.time_s > stood, "time to go on")


def test_a_port_that_is_taken_is_said(capsys):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        assert run(["view", "--robot", "point-mass", "--port", str(port)]) == 2
    assert f"cannot serve at port {port}" in capsys.readouterr().err


def test_the_page_is_for_this_machine_alone():
    with serving(0) as server:
        assert server.get_host() == "127.0.0.1"


@pytest.mark.parametrize("package", ["viser", "mjviser"])
def test_a_missing_extra_is_said(monkeypatch, capsys, package):
    for name in [*sys.modules]:
        if name.startswith(("rebody.viewer", f"{package}.")):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    assert run(["view"]) == 2
    assert "pip install 'rebody[view]'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--task", "velocity=1", "--inference", "position"], "cannot infer 'velocity'"),
        (["--robot", "cheeta"], "Did you mean 'cheetah'"),
        (["--agent", "magic"], "Agents are: reuse"),
        (["--robot", "point-mass", "--agent", "flat"], "learned on a robot, and a point mass is none"),
    ],
)
def test_what_cannot_be_shown_first_is_said_before_there_is_a_page(arguments, says, capsys):
    assert run(["view", *arguments]) == 2
    printed = capsys.readouterr()
    assert says in printed.err
    assert "127.0.0.1" not in printed.out
