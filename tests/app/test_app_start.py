"""The first page: the server listens before any numerical library is loaded."""

from __future__ import annotations

import asyncio
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
from served import served

from app.client.simulation import trouble_of
from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from app.link.process import Process
from app.web.visit import FIRST_TEXT, Visit
from browsing.wire import Wire, eventually
from lessons.course import COURSE, heading, load_lesson
from lessons.scenes.run_spec import RunSpec
from robots import InputError

ROOT = Path(__file__).parents[2]
NUMERICS = ("scipy", "pinocchio", "mujoco", "numba", "trimesh", "coal", "daqp", "matplotlib")

LISTEN = f"""
import sys, urllib.request
from app.link.choice import SceneChoice
from lessons.scenes.run_spec import RunSpec
from app.web import server
from browsing.wire import let_in
server._load_on_thread = lambda choice: None  # what follows once it listens
for choice in (
    SceneChoice(RunSpec("iiwa14-hold")),
    SceneChoice(RunSpec("ridgeback-ur10-square")),
    SceneChoice.opening("one-task"),
):
    running = server.PageServer(choice, server.ServerOptions(port=0))
    try:
        page = urllib.request.Request(running.url, headers={{"Cookie": let_in(running.link)}})
        assert urllib.request.urlopen(page).status == 200
    finally:
        running.close()
print(*sorted(set({NUMERICS}) & set(sys.modules)))
"""


SHOWN = """
import sys
from app.link.choice import SceneChoice
from lessons.scenes.run_spec import RunSpec
from app.web.server import PageServer, ServerOptions
from browsing.wire import Wire, eventually
for scene, named in (("iiwa14-hold", None), ("ridgeback-ur10-square", True)):
    running = PageServer(SceneChoice(RunSpec(scene)), ServerOptions(port=0, class_names=named))
    try:
        with Wire(running.guest_link) as page:
            assert eventually(lambda: page.shows("Running"), 110.0)
    finally:
        running.close()
print(*sorted({"numba", "matplotlib"} & set(sys.modules)))
"""


@pytest.mark.parametrize("program", [LISTEN, SHOWN], ids=["listens", "shows a robot"])
def test_the_process_of_the_pages_does_not_load_what_computes(program: str) -> None:
    """viser itself needs NumPy. All other libraries are loaded after the server listens, while the browser
    opens. A running robot is shown without Numba and matplotlib, on both levels and with a class."""
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, timeout=240, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == []


def test_names_are_judged_without_loading_and_files_by_loading() -> None:
    assert (
        SceneChoice(RunSpec("iiwa14-hold")).known
        and SceneChoice(RunSpec("ridgeback-ur10-delivery", seed=3)).known
    )
    assert not SceneChoice(RunSpec("hold")).known and not SceneChoice(RunSpec("iiwa14-hodl")).known
    assert not SceneChoice(RunSpec("hold", "mine.urdf")).known
    assert not SceneChoice(RunSpec("iiwa14-hold", set=("horizon=0",))).known
    with pytest.raises(InputError, match="'one-task'"):
        SceneChoice.opening("one-tsak")


def test_a_lesson_opens_with_what_its_file_says() -> None:
    opening = SceneChoice.opening("one-task")
    resolved = opening.resolved()
    assert opening.known and resolved.exercise == opening.exercise
    assert resolved == SceneChoice.of_lesson(opening.exercise) if opening.exercise else False
    assert resolved.resolved() is resolved


class Unborn(Process):
    """A process that waits until the compilation has finished."""

    def __init__(self) -> None:
        pass

    @property
    def preparing(self) -> str:
        return "compiling the controllers, only this time, for about half a minute: 3 of 40 functions"


def test_a_page_says_at_once_what_is_compiled() -> None:
    trouble = trouble_of(Unborn(), loading=False, quiet=0.1)
    assert trouble is not None and trouble.offer is None
    assert "about half a minute: 3 of 40 functions, 0 s so far" in trouble.sentence


class First(Wire):
    """A browser that keeps the labels of the panel that it was sent."""

    def __init__(self, url: str) -> None:
        self.labels: list[str] = []
        super().__init__(url)

    def _take(self, message: dict[str, Any]) -> None:
        if message["type"] == "SetGuiPanelLabelMessage":
            self.labels.append(message["label"])
        super()._take(message)


def test_the_first_frame_is_the_labs_own_and_goes_when_the_page_is_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A browser gets the lab's panel before its visit begins: what all browsers get, not only this one."""
    arrive, wait = Visit.arrive, threading.Event()

    async def late(visit: Visit) -> None:
        await asyncio.to_thread(wait.wait, 40.0)
        await arrive(visit)

    monkeypatch.setattr(Visit, "arrive", late)
    with served(SceneChoice.opening("two-tasks")) as running, First(running.link) as page:
        assert eventually(lambda: page.shows("Starting the robot …"))
        assert page.shows("<b>Lesson 4 · Two tasks, one arm</b>") and "himpc-lab" in page.labels
        assert not any(FIRST_TEXT in each for each in page.scripts)
        wait.set()
        assert eventually(lambda: any(FIRST_TEXT in each for each in page.scripts), 60.0)


def test_a_lesson_opens_by_its_title() -> None:
    for words in ("A redundant arm", "a redundant ARM", "a-redundant-arm"):
        assert SceneChoice.opening(words).exercise == LessonPlace("a-redundant-arm")
    assert {heading(name) for name in COURSE} == {
        (card.title, card.question) for card in (load_lesson(name).card for name in COURSE)
    }
