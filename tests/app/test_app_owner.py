"""Only the user who started the server can run Python files from the page, and only files in one folder."""

from __future__ import annotations

import base64
import json
import re
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from served import served
from viser import __version__
from websockets.sync.client import connect

from app.adapter import private
from app.link.choice import SceneChoice
from app.link.process import wait_until
from app.web.guard import GuardedConnection
from app.web.server import PageServer
from app.web.sessions import Classroom
from browsing.wire import Wire, camera, eventually, let_in, pack
from lessons.own.files import Folder
from lessons.scenes.run_spec import RunSpec
from robots import CATALOG, InputError, load_robot
from robots.errors import shortened

LONG = 120.0
RUNS = """
from pathlib import Path
Path({mark!r}).touch()
def torque(now):
    return now.bias - 10 * now.M_bar * now.q_dot
"""


@pytest.fixture
def mark(tmp_path: Path) -> Path:
    """Returns the path of a file that exists after the code was run."""
    return tmp_path / "was-run"


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """Returns the folder of the server's files."""
    folder = tmp_path / "secret-place" / "own"
    folder.mkdir(parents=True)
    return folder


@contextmanager
def serving(own: Path | None, **more: Any) -> Iterator[PageServer]:
    choice = more.pop("choice", SceneChoice(RunSpec("planar3-hold")))
    files = None if own is None else Folder.at(str(own))
    with served(choice, own_files=files, **more) as server:
        yield server


def built(page: Wire, times: int = 1) -> bool:
    """Returns whether the Robot tab was built this many times. The last folder of the tab is created after
    all fields for files."""
    return eventually(lambda: page.folders("Import report") >= times, LONG)


def code_that_runs(path: Path, mark: Path) -> Path:
    path.write_text(RUNS.format(mark=str(mark)))
    return path


def ask(page: Wire, field: str, path: object, button: str) -> None:
    page.use(field, str(path))
    page.use(button)


def answer(page: Wire) -> Callable[[], str]:
    """Returns a function that reads the text beside NOT LOADED."""

    def text() -> str:
        shown = [each["props"] for each in list(page.controls.values()) if each["props"].get("visible", True)]
        return next((each["content"] for each in shown if "NOT LOADED" in str(each.get("content", ""))), "")

    return text


def test_files_are_opened_only_on_the_page_of_the_owners_address(own: Path, mark: Path) -> None:
    law = code_that_runs(own / "law.py", mark)
    with serving(own, max_sessions=2) as server:
        assert server.link != server.guest_link
        with Wire(server.guest_link) as guest:
            assert built(guest)
            assert guest.find("Your file") is None and guest.find("File") is None
        with Wire(server.link) as page:
            assert built(page)
            ask(page, "Your file", "law.py", "Open file")  # relative to the folder
            assert eventually(mark.exists, LONG)
            learner = server.sessions.learners[-1]
            assert eventually(
                lambda: (
                    learner.settings is not None
                    and getattr(learner.settings, "controller", "") == str(law.resolve())
                ),
                LONG,
            )


def test_without_a_folder_nobody_opens_files(own: Path) -> None:
    with serving(None, max_sessions=1) as server, Wire(server.link) as page:
        assert server.link == server.guest_link
        assert built(page)
        assert page.find("Your file") is None and page.find("File") is None


def test_who_watches_a_classroom_opens_no_files(own: Path) -> None:
    """A page that opened the owner's address may open files only after it took control, because its screen
    may be visible to all."""
    with serving(own, classroom=True) as server:
        for link in (server.guest_link, server.link):
            with Wire(link) as page:
                assert built(page)
                assert page.shows("you are watching")
                assert page.find("Your file") is None and page.find("File") is None
        assert isinstance(server.sessions, Classroom)
        for link, offered in ((server.guest_link, False), (server.link, True)):
            with Wire(link) as page:
                page.use("Instructor's token", server.sessions.token)
                assert eventually(lambda page=page: not page.shows("you are watching"), LONG)
                assert built(page, times=2)
                assert (page.find("Your file") is not None) is offered


def test_a_request_that_a_proxy_passes_on_is_not_the_owners(own: Path) -> None:
    """A forwarded request does not count as the owner's, even with the owner's secret or cookie."""
    protocol: Any = [f"viser-v{__version__}"]
    with serving(own, max_sessions=3) as server:
        cookie = let_in(server.link)
        found: list[bool] = []
        for headers in ({}, {"X-Forwarded-Host": "lab"}, {"Via": "1.1 proxy"}, {"X-Real-IP": "10.0.0.1"}):
            with connect(
                server.url.replace("http", "ws"),
                subprotocols=protocol,
                max_size=None,
                additional_headers={"Cookie": cookie, **headers},
            ) as page:
                page.send(pack(camera()))
                assert wait_until(lambda: bool(server._viser.get_clients()), LONG)
                (client,) = server._viser.get_clients().values()
                line = private.connection_of(server._viser, client)
                assert isinstance(line, GuardedConnection)
                found.append(line.is_owners)
            assert wait_until(lambda: not server._viser.get_clients(), LONG)
        assert found == [True, False, False, False]


def test_nothing_outside_the_folder_is_opened(own: Path, mark: Path) -> None:
    """No form of the path leads outside the folder, and the message is the same whether the file exists or
    not."""
    outside = code_that_runs(own.parent / "outside.py", mark)
    (own / "link.py").symlink_to(outside)
    (own / "up").symlink_to(own.parent)
    robot = own.parent / "robot.urdf"
    robot.write_bytes(CATALOG["planar3"].path.read_bytes())
    paths = (outside, "../outside.py", "link.py", "up/outside.py", own / ".." / "outside.py")
    nowhere = ("../nothing.py", "/nowhere/nothing.py", "up/nothing.py")
    with serving(own, max_sessions=1) as server, Wire(server.link) as page:
        assert built(page)
        said = answer(page)
        for field, button, tried in (
            ("Your file", "Open file", (*paths, *nowhere)),
            ("File", "Load file", (robot, "../robot.urdf", "up/robot.urdf", "../nothing.urdf")),
        ):
            sentences = set[str]()
            for path in tried:
                ask(page, field, path, button)
                told = f"{shortened(str(path), 100)}: the page opens only files below"
                assert eventually(lambda told=told: told in said(), 20.0), path
                sentences.add(said().partition(": the page opens only files")[2])
            assert len(sentences) == 1
            assert str(own.parent) not in sentences.pop()
        assert not mark.exists()
        assert server.sessions.learners[0].choice == SceneChoice(RunSpec("planar3-hold"))


def test_a_code_opens_no_file_and_does_not_say_where_files_lie(own: Path, mark: Path) -> None:
    other = code_that_runs(own / "other.py", mark)
    mine = own / "mine.py"
    mine.write_text(RUNS.replace("Path({mark!r}).touch()", ""))
    choice = SceneChoice.starting("planar3-hold", controller=str(mine))
    with serving(own, choice=choice, max_sessions=1) as server, Wire(server.guest_link) as page:
        assert eventually(lambda: page.find("Somebody's code") is not None, LONG)
        for setting, word in (
            (f'controller="{other}"', "may not open files"),
            ('controller="mine.py@0123456789ab"', "its fingerprint is"),
            ("controller=himcp", "Choose one of"),
        ):
            page.use("Somebody's code", encoded(setting))
            page.use("Open it")
            assert eventually(lambda word=word: any(word in body for _, body in page.notices), 20.0), (
                setting,
                page.notices,
            )
        assert not [body for _, body in page.notices if "secret-place" in body]
        assert not mark.exists()


def encoded(setting: str) -> str:
    """Returns a code that is written by hand; `encode` would mark the file."""
    text = json.dumps({"s": "planar3-hold", "a": [setting]}, separators=(",", ":"))
    return "hl1-" + base64.urlsafe_b64encode(zlib.compress(text.encode(), 9)).decode().rstrip("=")


def test_meshes_of_a_robot_that_the_page_names_lie_in_its_folder(own: Path) -> None:
    mesh = "o\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    (own / "inside.obj").write_text(mesh)
    (own.parent / "outside.obj").write_text(mesh)
    (own / "link.obj").symlink_to(own.parent / "outside.obj")
    text = CATALOG["planar3"].path.read_text()
    at = text.index("<link", text.index("<link") + 1)
    end = text.index(">", at) + 1
    names = ("inside.obj", "../outside.obj", "link.obj", f"file://{own.parent}/outside.obj")
    visuals = "".join(f'<visual><geometry><mesh filename="{name}"/></geometry></visual>' for name in names)
    (own / "robot.urdf").write_text(text[:end] + visuals + text[end:])
    robot = load_robot(own / "robot.urdf", within=own.resolve())
    assert re.findall(r"\w+\.obj", robot.urdf_text) == ["inside.obj"]
    assert "3 mesh file(s) not found" in str(robot.report.findings)
    with pytest.raises(InputError, match="not in the folder"):
        load_robot(CATALOG["planar3"].path, within=own.resolve())
