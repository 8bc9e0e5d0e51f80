"""A classroom without a browser: the restrictions of watchers, and the token."""

from __future__ import annotations

import asyncio
import inspect
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, cast

import pytest
from served import LONG, served

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.messages import Play
from app.panels.run.classroom import Guesses
from app.web.passes import new_token
from app.web.sessions import STEERING, Classroom, Watcher
from browsing.wire import Wire, eventually
from lessons.scenes.run_spec import RunSpec

ROOT = Path(__file__).parents[2] / "app"


def test_watchers_change_nothing() -> None:
    sent: list[Any] = []

    class Shown:
        choice, settings = "a scene", "settings"

        def send(self, command: object) -> None:
            sent.append(command)

    refused: list[str] = []
    watcher = cast(SimulationClient, Watcher(cast(SimulationClient, Shown()), refused.append))
    watcher.send(Play(False))
    watcher.reset_all()
    watcher.restart(cast(SceneChoice, "another scene"))
    watcher.stop_ghost()
    watcher.load(SceneChoice(RunSpec("planar3-hold")))
    assert sent == []
    assert refused == [STEERING] * 5
    assert (watcher.choice, watcher.settings) == ("a scene", "settings")
    assert watcher.take_messages() == ([], [])
    with pytest.raises(AttributeError):
        watcher.choice = cast(Any, "shadowed for good")  # pyright: ignore[reportAttributeAccessIssue]


def test_watchers_have_what_pages_use() -> None:
    """`Watcher` has every attribute of a learner that the code of a page uses."""
    used = {
        found
        for folder in ("page", "panels", "tab", "view", "client/moment.py")
        for path in ([ROOT / folder] if folder.endswith(".py") else (ROOT / folder).rglob("*.py"))
        for found in re.findall(r"\blearner\.([a-z]\w*)", path.read_text())
    }
    assert {"send", "settings_of", "look"} <= used
    assert {name for name in used if not hasattr(Watcher, name)} <= {"import"}
    own = {
        name: found for name, found in vars(Watcher).items() if inspect.isfunction(found) and name[0] != "_"
    }
    assert own
    for name, found in own.items():
        ours, theirs = (
            inspect.signature(each).parameters.values() for each in (found, getattr(SimulationClient, name))
        )
        assert [(each.name, each.default) for each in ours] == [(each.name, each.default) for each in theirs]


def test_guesses_of_one_page_wait_for_each_other_only() -> None:
    """The guesses of one page are checked one at a time, so that a thousand wrong ones do not delay the right
    token of another page."""
    looked_at: list[str] = []

    def give(token: str) -> bool:
        looked_at.append(token)
        return token == "right"

    async def attack() -> bool | None:
        hostile, instructor = Guesses(give), Guesses(give)
        assert await hostile.offer("first") is False
        flood = [asyncio.ensure_future(hostile.offer(str(k))) for k in range(1000)]
        await asyncio.sleep(0)
        right = await instructor.offer("right")
        assert looked_at == ["first", "right"]
        for guess in flood:
            guess.cancel()
        return right

    with ThreadPoolExecutor(1) as elsewhere:  # the browser of other tests has an event loop on this thread
        assert elsewhere.submit(lambda: asyncio.run(attack())).result()


def test_the_token_is_long_and_only_itself() -> None:
    token = Classroom.__new__(Classroom)
    token.token = new_token()
    assert len(token.token) == 22  # 128 bits
    assert token.is_right(token.token)
    assert not any(map(token.is_right, ("", token.token[:-1], token.token + "a", "\ud800é")))


def test_only_the_token_steers_and_all_pages_are_counted() -> None:
    """A page without the token shows the same robot and cannot stop it; with the token it can. Pages are also
    counted if a watcher enters the token or the teacher leads; otherwise /metrics would be wrong."""
    with served(classroom=True, class_names=False) as server:
        room = server.sessions
        assert isinstance(room, Classroom)
        assert server.guard.load.attached == 0
        with Wire(server.guest_link) as page:
            (learner,) = room.learners
            assert eventually(lambda: page.shows("you are watching"), LONG)
            page.use("Playback", "Pause")
            assert eventually(lambda: any(STEERING in body for _, body in page.notices), LONG)
            assert learner.status is not None and learner.status.running
            page.use("Instructor's token", "wrong")
            assert eventually(lambda: page.shows("That is not the token."), LONG)
            page.use("Instructor's token", room.token)
            assert eventually(lambda: page.find("Instructor's token") is None, LONG)
            assert server.guard.load.attached == 1 and not page.shows("you are watching")
            page.use("Playback", "Pause")
            assert eventually(lambda: learner.status is not None and not learner.status.running, LONG)
            with Wire(server.link):
                assert eventually(lambda: room.pages == 2, LONG)
            assert eventually(lambda: room.pages == 1, LONG)
        assert eventually(lambda: room.pages == 0, LONG) and server.guard.load.attached == 0
