"""A class whose server is killed and started again with the same command."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest
from served import LONG, free_port
from test_app_class import STEP, Line, cookie_of

from app.classes.gathering import Gathering
from app.classes.saved import restored, saved
from app.link.exercise import Lecture, LessonPlace
from app.link.process import wait_until
from app.web.class_file import KEPT, ClassFile
from browsing.wire import Wire
from lessons.course import COURSE

ROOT = Path(__file__).parents[2]
OTHER = LessonPlace("a-redundant-arm", 1)


class Started:
    """A class that was started with the command, in a process of its own. lines: what it printed."""

    def __init__(self, port: int, home: Path, *more: str) -> None:
        options = ["--class", "--no-browser", "--scene=planar3-hold", "--max-sessions=1", f"--port={port}"]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "app", *options, *more],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT), "XDG_STATE_HOME": str(home)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        self.lines: dict[str, str] = {}
        for line in self.process.stdout:
            name, _, rest = line.strip().partition(":")
            self.lines[name] = rest.strip()
            if line.startswith("  Keep the first address"):
                break
        assert "phones" in self.lines, self.process.communicate()

    def end(self, number: signal.Signals) -> str:
        """Sends a signal, waits for the end, and returns what was printed as errors."""
        self.process.send_signal(number)
        return self.process.communicate(timeout=LONG)[1]


def phone_at(address: str, seat: str = "") -> Line:
    line = Line(address)
    line.send(do="hello", seat=seat)
    line.hear("seat")
    return line


def contains(folder: Path, text: str) -> bool:
    return any(text in each.read_text() for each in folder.glob("himpc-lab/class-*.json"))


def test_a_class_whose_server_is_killed_goes_on_with_its_addresses_and_votes(tmp_path: Path) -> None:
    port = free_port()
    first = Started(port, tmp_path)
    try:
        cookie, phones, others = (
            cookie_of(first.lines["teacher"]),
            first.lines["phones"],
            first.lines["for others"],
        )
        with Line(first.lines["teacher"]) as lead, Wire(others) as page, phone_at(phones) as one:
            page.use("Your name", "Zoë")
            lead.send(do="set", stays=True, everywhere=False)
            lead.send(do="go", lesson=STEP.lesson, place=STEP.place)
            lead.until("all", "stage", "waiting")
            lead.send(do="press", button="open")
            one.until("all", "stage", "open")
            one.send(do="vote", answer=1)
            assert one.hear("mine")["mine"] == 1
            seat = one.told["seat"]
            assert wait_until(lambda: contains(tmp_path, f'"{seat}":1') and contains(tmp_path, "Zoë"), LONG)
            (file,) = tmp_path.glob("himpc-lab/class-*")
            assert stat.S_IMODE(file.stat().st_mode) == 0o600
            assert stat.S_IMODE(file.parent.stat().st_mode) == 0o700
            first.end(signal.SIGKILL)
        first = Started(port, tmp_path)
        assert (phones, others) == (first.lines["phones"], first.lines["for others"])
        assert "with 2 people" in first.lines["continues"]
        with (
            Line(f"{phones.partition('/v/')[0]}/class", Cookie=cookie) as lead,
            phone_at(phones, seat) as one,
        ):
            assert one.told["seat"] == seat and one.told["mine"] == 1
            told = lead.until("all", "stage", "open")
            assert told["voted"] == 1 and "A redundant arm" in told["title"]
            assert lead.told["class"]["stays"] and not lead.told["class"]["everywhere"]
            assert [row["name"] for row in lead.told["class"]["rows"]] == ["Zoë"]
            one.send(do="vote", answer=0)
            assert one.hear("mine")["mine"] == 0
            assert lead.told["all"]["voted"] == 1, "it is the same person's vote"
            lead.send(do="press", button="close")
            lead.send(do="press", button="run")
            lead.until("all", "stage", "decided")
        assert "Traceback" not in first.end(signal.SIGTERM)
        assert list(tmp_path.glob("himpc-lab/class-*")) == [file], "a service that is stopped goes on, too"

        first = Started(port, tmp_path)
        assert first.lines["phones"] == phones
        first.end(signal.SIGINT)
        assert list(tmp_path.glob("himpc-lab/*")) == [], "Ctrl-C ends the class, the next has another code"
    finally:
        first.end(signal.SIGKILL)


def test_a_class_without_names_leaves_no_file(tmp_path: Path) -> None:
    started = Started(free_port(), tmp_path, "--no-names")
    try:
        with phone_at(started.lines["phones"]):
            time.sleep(0)
    finally:
        started.end(signal.SIGTERM)
    assert list(tmp_path.iterdir()) == []


def test_a_saved_class_is_the_same_class() -> None:
    """Its members' pages are not open, and a run that was not over can be run again. Steps that this class
    does not have are left out."""
    lecture = Lecture(OTHER, "done", 1, 0.0, 1.0, answer=0, holds=(True, False))
    state = Gathering().entered("zoe", "robot", 0.0, "zoe@lab").entered("max", "phone", 0.0)
    state = state.called("max", "Max").going_to(STEP).opened().voted("max", 1, 0.0).closed()
    state = state.opened().voted("zoe", 0, 0.0).closed().started().measured(0.25)
    state = state.going_to(OTHER).seen("zoe", OTHER, lecture, 1.0)
    again = restored(saved(state), frozenset(COURSE))
    assert (again.place, again.past, again.stage) == (OTHER, state.past, "waiting")
    assert [(each.number, each.kind, each.name, each.account) for each in again.members.values()] == [
        (1, "robot", "zoe@lab", "zoe@lab"),
        (2, "phone", "Max", ""),
    ]
    assert again.members["zoe"].done == {OTHER: (1, 2)} and again.members["zoe"].at == OTHER
    assert not any(each.here for each in again.members.values())
    running = Gathering().going_to(STEP).opened().voted("zoe", 1, 0.0).started()
    assert restored(saved(running), frozenset(COURSE)).stage == "closed"
    none = restored(saved(state), frozenset())
    assert none.place is None and none.past == () and none.members["zoe"].done == {}


@pytest.mark.parametrize("content", ["", "[" * 5000, '{"code":"abc"}', "\x00"])
def test_a_file_that_is_no_class_begins_a_new_one(
    content: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "class-1.json"
    file.write_text(content)
    file.chmod(0o600)
    assert ClassFile(file).read() is None
    assert "a new class begins" in capsys.readouterr().err


def test_a_file_of_yesterday_and_one_that_others_may_read_are_not_used(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, old = tmp_path / "class-1.json", tmp_path / "class-2.json"
    file.write_text("{}")
    file.chmod(0o644)
    old.touch()
    before = time.time() - KEPT - 60.0
    os.utime(old, (before, before))
    assert ClassFile(file).read() is None and not old.exists()
    assert "other users can read" in capsys.readouterr().err
