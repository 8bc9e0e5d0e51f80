"""A page opens its learner's own files by path: only for the user who started the server, only in one folder.
It signs the work that a learner hands in."""

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
from served import LONG, served

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.web.server import PageServer
from app.web.sessions import Classroom
from browsing.wire import Wire, eventually
from lessons.authoring.new import text_of
from lessons.own.files import Folder
from lessons.replay.progress import read_handed_in
from lessons.replay.state import decode
from lessons.scenes.run_spec import RunSpec
from lessons.settings.torque import TorqueSettings
from robots import CATALOG, InputError, load_robot
from robots.errors import shortened

KEY = b"an instructor's key"
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
    code_that_runs(own / "law.py", mark)
    with serving(own, max_sessions=2) as server:
        assert server.link != server.guest_link
        with Wire(server.guest_link) as guest:
            assert built(guest)
            assert guest.find("Your file") is None and guest.find("File") is None
        with Wire(server.link) as page:
            assert built(page)
            ask(page, "Your file", "law.py", "Open file")  # relative to the folder
            assert eventually(mark.exists, LONG)


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
            ("horizn=3", "horizon"),
        ):
            page.use("Somebody's code", encoded(setting))
            page.use("Open it")

            def refused(word: str = word) -> bool:
                return any(title == "Not loaded" and word in body for title, body in page.notices)

            assert eventually(refused, 20.0), (setting, page.notices)
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


def settings(learner: SimulationClient) -> TorqueSettings:
    assert isinstance(learner.settings, TorqueSettings)
    return learner.settings


def test_files_of_ones_own_are_opened_by_path(tmp_path: Path) -> None:
    """A file may contain a controller for the present scene, or a task to add. For a file with an error, the
    page shows a message of one sentence."""
    law, task, wrong = (tmp_path / f"{name}.py" for name in ("law", "task", "wrong"))
    law.write_text("def torque(now):\n    return now.bias - 10 * now.M_bar * now.q_dot\n")
    task.write_text(text_of("task", None, "task.py"))
    wrong.write_text("def torque(now)\n    return 0\n")
    with serving(tmp_path) as server, Wire(server.link) as wire:
        assert eventually(lambda: wire.shows("never uploaded"), LONG)
        learner = server.sessions.learners[0]
        ask(wire, "Your file", wrong, "Open file")
        assert eventually(lambda: wire.shows("wrong.py, line 1: expected"), LONG)
        ask(wire, "Your file", tmp_path / "nothing.py", "Open file")
        assert eventually(lambda: wire.shows("cannot be read"), LONG)
        ask(wire, "Your file", law, "Open file")
        assert eventually(
            lambda: learner.settings is not None and learner.settings.controller == str(law), LONG
        )
        assert eventually(lambda: wire.shows("a controller of your own"), LONG)
        ask(wire, "Your file", task, "Open file")
        assert eventually(lambda: bool(settings(learner).own_tasks), LONG)

        def offered() -> bool:
            uuid = wire.find("Kind")
            return uuid is not None and str(task) in wire.controls[uuid]["props"]["options"]

        assert eventually(offered, LONG)
        wire.use("Kind", str(task))
        wire.use("Add")
        assert eventually(lambda: "reach" in [level.name for level in settings(learner).levels], LONG), (
            wire.notices
        )
        assert settings(learner).controller == str(law)
        assert learner.failure is None

        task.write_text(task.read_text().replace('name="reach"', 'name="reach", frame="ee"'))
        wire.use("Robot", "panda")
        wire.use("Load robot")
        assert eventually(lambda: wire.shows("LEFT OUT"), LONG)
        assert learner.ready is not None and learner.ready.robot.name == "panda"
        assert eventually(lambda: "Opened without one of your tasks" in dict(wire.notices), LONG)


def test_a_scene_and_a_lesson_are_opened_instead(tmp_path: Path) -> None:
    here = SceneChoice(RunSpec("planar3-hold"))
    for kind in ("scene", "lesson"):
        path = tmp_path / (f"{kind}.py" if kind == "scene" else f"{kind}.md")
        path.write_text(text_of(kind, None, path.name))
        found = here.with_file(str(path)).admitting(here).resolved()
        assert found.scene().name == (str(path) if kind == "scene" else "iiwa14-hold")
    with pytest.raises(InputError, match=r"no\.py: cannot be read"):
        here.with_file(str(tmp_path / "no.py"))


def test_what_was_done_is_handed_in_with_the_labs_signature(own: Path) -> None:
    with serving(own, key=KEY) as server, Wire(server.link) as wire:
        wire.use("Your name", "Zoë")
        wire.use("Write the text")

        def text() -> str:
            return str(wire.controls[str(wire.find("To hand in"))].get("value", ""))

        assert eventually(lambda: text().startswith("hp1s-"), LONG)
        handed, proof = read_handed_in(text(), KEY)
        assert (handed.name, proof) == ("Zoë", "signed")
        assert decode(handed.code).run.scene == "planar3-hold"
