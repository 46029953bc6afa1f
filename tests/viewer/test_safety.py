"""What no widget sends, and sessions that fail: the page goes on."""

import math
import random
import threading
import time
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import pytest

from rebody.tasks.task_file import TaskSpec

viser = pytest.importorskip("viser")
pytest.importorskip("mjviser")
from rebody.viewer import page as page_module  # noqa: E402
from rebody.viewer.controls import SPEEDS, Choice, Offered  # noqa: E402
from rebody.viewer.page import Page  # noqa: E402
from rebody.viewer.server import serving  # noqa: E402

FIRST, TASK = Choice("point-mass", "tiny", "reuse"), TaskSpec("goal", (2.0,))
OFFERED = Offered(["point-mass"], ["tiny"])
MESSAGES = 1000
PATIENCE_S = 60.0


@pytest.fixture(scope="module")
def toy_trial(trial):
    return replace(trial, robot=None, tracker=None)


@contextmanager
def shown(load: Callable[[Choice], Any]):
    """A page that runs in a thread of its own, and its port."""
    with serving(0) as server:
        page = Page(server, OFFERED, load, FIRST, load(FIRST), TASK)
        thread = threading.Thread(target=page.run)
        thread.start()
        wait_for(lambda: hasattr(page, "session"), "the start")
        try:
            yield page, server.get_port()
            assert thread.is_alive()
        finally:
            page.end()
            thread.join()


def wait_for(condition: Callable[[], bool], what: str) -> None:
    began = time.monotonic()
    while not condition():
        assert time.monotonic() - began < PATIENCE_S, f"waited in vain: {what}"
        time.sleep(0.05)


def test_the_page_survives_a_thousand_random_messages_and_obeys(visit, toy_trial):
    loaded: list[Choice] = []

    def load(choice: Choice):
        loaded.append(choice)
        return replace(toy_trial, agent=choice.agent)

    with shown(load) as (page, port), visit(port) as browser:
        widgets = browser.widgets()
        browser.look()
        chance = random.Random(7)
        for _ in range(MESSAGES):
            browser.send(hostile(chance, browser, [*widgets.values()]))

        def obeys() -> bool:  # not at once: what was refused before puts the controls back
            for label, value in {"Kind": "goal", "Target": 1.0, "Change the task now": True}.items():
                browser.change(widgets[label], value)
            time.sleep(0.1)
            return page.session.task == TaskSpec("goal", (1.0,))

        wait_for(obeys, "a good order")
        if page.controls.paused:
            browser.change(widgets["Pause"], True)
        session, stood = page.session, page.session.time_s
        wait_for(lambda: session.time_s > stood or page.session is not session, "time to go on")
        assert SPEEDS[0] <= page.controls.speed <= SPEEDS[1]
    assert all(choice.robot == "point-mass" and choice.inference == "tiny" for choice in loaded)


VALUES = [math.nan, math.inf, -math.inf, 1e300, -5, 2**63, "nan", "inf", "/dev/zero", "../../etc", "", "x" * 9000]
VALUES += [True, None, [], [math.nan], {"a": 1}, b"\0", "oracle", "idle", "velocity", "+1", 0.5]
PROPERTIES = ["value", "removed", "props", "update_cb", "sync_cb", "gui_api", "is_button", "options", "__class__"]


def hostile(chance: random.Random, browser, uuids: list[str]) -> Any:
    """Anything that can be sent: nonsense, messages of viser's, real widgets with what they do not offer."""
    uuid, value = chance.choice([*uuids, "unknown"]), chance.choice(VALUES)
    kinds = sorted(cls.__name__ for cls in viser.infra.Message.get_subclasses())
    return chance.choice(
        [
            chance.randbytes(chance.randrange(80)),
            "text",
            value if not isinstance(value, bytes | str) else [value],
            {"type": chance.choice(kinds), "uuid": uuid, "source_component_uuid": uuid, "value": value},
            {"type": "FileTransferStartUpload", "source_component_uuid": uuid, "transfer_uuid": "t", "filename": "f",
             "mime_type": "m", "part_count": 0, "size_bytes": 0},
            {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {chance.choice(PROPERTIES): value}},
            {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}},
            {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}},
            browser.view(value),
        ]
    )  # fmt: skip


@pytest.fixture
def heard(monkeypatch) -> list[str]:
    """What is said to somebody who, the page believes, looks on."""
    said: list[str] = []

    class Onlooker:
        def add_notification(self, title: str, body: str, **_: object) -> None:
            said.append(body)

    monkeypatch.setattr(viser.ViserServer, "get_clients", lambda _: {0: Onlooker()})
    return said


@pytest.mark.parametrize("value", ["/dev/zero", "cheetah", ""])
def test_a_robot_that_is_not_offered_is_not_loaded(visit, toy_trial, heard, value):
    loaded: list[Choice] = []

    def load(choice: Choice):
        loaded.append(choice)
        return toy_trial

    with shown(load) as (page, port), visit(port) as browser:
        widgets = browser.widgets()
        browser.look()
        browser.change(widgets["Robot"], value)
        wait_for(lambda: heard == ["this robot is not offered here."], "a complaint")
        wait_for(lambda: page.controls._robot.value == "point-mass", "the choice to be taken back")
    assert loaded == [FIRST]


def test_sliders_take_numbers_in_their_range(visit, toy_trial, heard):
    with shown(lambda _: toy_trial) as (page, port), visit(port) as browser:
        widgets = browser.widgets()
        browser.look()
        for said, taken in ((50.0, SPEEDS[1]), ("nan", 1.0), (-1, SPEEDS[0])):
            browser.change(widgets["Speed"], said)
            wait_for(lambda taken=taken: page.controls._speed.value == taken, "the speed")

        browser.change(widgets["Target"], 500.0)
        browser.change(widgets["Change the task now"], True)
        wait_for(lambda: page.session.task.target == (10.0,), "the farthest goal")
        browser.change(widgets["Target"], "nan")
        browser.change(widgets["Change the task now"], True)
        wait_for(lambda: bool(heard), "a complaint")
        assert "the target is nan" in heard[0]
        assert page.session.task.target == (10.0,)
        wait_for(lambda: page.controls._targets[0].value == 10.0, "the target to be put back")


def test_a_target_that_is_no_number_leaves_the_task_as_it_was(toy_trial, heard):
    with shown(lambda _: toy_trial) as (page, _):
        page.controls.orders.put(TaskSpec("goal", (math.nan,)))
        wait_for(lambda: bool(heard), "a complaint")
        assert page.session.task == TASK


def test_who_cannot_be_watched_is_said_and_the_one_before_goes_on(toy_trial, heard, monkeypatch):
    def load(choice: Choice):
        if choice.agent == "flat":
            raise OSError("no such file")
        return toy_trial

    def no_scene(*_):
        raise ValueError("no such shape")

    with shown(load) as (page, _):
        session = page.session
        page.controls.orders.put(replace(FIRST, agent="flat"))
        wait_for(lambda: len(heard) == 1 and "no such file" in heard[0], "a complaint")

        scenes = iter([no_scene, page_module.Scene])
        monkeypatch.setattr(page_module, "Scene", lambda *arguments: next(scenes)(*arguments))
        page.controls.orders.put(replace(FIRST, agent="idle"))
        wait_for(lambda: len(heard) == 2 and "no such shape" in heard[1], "another")
        stood = session.time_s
        wait_for(lambda: session.time_s > stood, "time to go on")
        assert page.session is session
        assert page.controls._agent.value == "reuse"


def test_a_session_that_fails_starts_again(toy_trial, heard, monkeypatch):
    with shown(lambda _: toy_trial) as (page, _):
        wait_for(lambda: page.session.time_s > 1.5, "the start")
        step = page.session.step

        def fails_once():
            monkeypatch.setattr(page.session, "step", step)
            raise ValueError("something new")

        monkeypatch.setattr(page.session, "step", fails_once)
        wait_for(lambda: bool(heard), "a complaint")
        assert "something new" in heard[0]
        assert "back at the start" in heard[0]
        wait_for(lambda: 0 < page.session.time_s < 1.5, "a start")
        assert not page.controls.paused


def test_a_session_that_always_fails_pauses_until_it_is_told_to_go_on(toy_trial, heard, monkeypatch):
    def fails():
        raise ValueError("something new")

    with shown(lambda _: toy_trial) as (page, _):
        wait_for(lambda: page.session.time_s > 1.5, "the start")
        with monkeypatch.context() as patched:
            patched.setattr(page.session, "step", fails)
            wait_for(lambda: page.controls.paused, "a pause")
            time.sleep(0.3)
            assert len(heard) == 2
            assert "the page is paused" in heard[1]
        page.controls.pause(False)
        wait_for(lambda: page.session.time_s > 0.2, "time to go on")
