"""A rehearsal of a class: learners with robots of their own and phones go through a lesson on two servers.

    python -m benchmarks.rehearsal [--learners 20] [--phones 200] [--lesson L] [--json -]

Starts two servers, each with half of the learners and phones, and drives both teachers' pages in step: for
each step of the lesson the class goes there, votes, votes again, and runs it on all robots. Then every
learner hands in and all texts are graded. Learners and phones use the protocol of their pages and draw
nothing. Exit code 0 if no vote, step or text was lost. Waiting times and real-time factors depend on the
cores and on what else they do; they are printed and not judged.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import psutil
from websockets.sync.client import connect

from app.__main__ import main as himpc_lab
from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from app.panels.widgets.logarithmic import STEPS
from app.server.server import PageServer
from benchmarks.phones import Crowd
from browsing.wire import Wire
from lessons.replay.progress import read_key
from lessons.teaching.prediction import Choice, Value

LONG = 300.0  # s
_THIS = (sys.executable, "-m", "benchmarks.rehearsal")
SERVERS = 2
KEY = "a key of a rehearsal"
Waits = dict[str, list[float]]


def main() -> int:
    """Measures as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--learners", type=int, default=20)
    parser.add_argument("--phones", type=int, default=200)
    parser.add_argument("--lesson", default="a-redundant-arm")
    parser.add_argument("--json", choices=["-"], default=None)
    parser.add_argument("--be-a-server", type=int, default=0)
    options = parser.parse_args()
    if options.be_a_server:
        be_a_server(options.be_a_server, options.lesson)
        return 0
    found = rehearsed(options.learners // SERVERS, options.phones // SERVERS, options.lesson)
    print(json.dumps(found, indent=1) if options.json else table(found))
    return 1 if found["lost"] else 0


# ------------------------------------------------------------------ a server


def be_a_server(learners: int, lesson: str) -> None:
    """Serves a class; tells its addresses, and for each line on stdin how long the run of each learner took
    and the processor time used so far, s."""
    with tempfile.TemporaryDirectory() as folder:
        key = Path(folder) / "key.txt"
        key.write_text(KEY)
        choice = SceneChoice.opening(lesson)  # a robot that waits for its step needs no processor
        server = PageServer(
            choice, port=0, max_sessions=learners, key=read_key(str(key)), class_names=True, grace=60.0
        )
        try:
            assert server.hall is not None
            links = {"learners": server.guest_link, "teacher": server.teachers_link}
            _tell({**links, "phones": f"{server.url.replace('http', 'ws')}/v/{server.hall.code}"})
            runs: dict[tuple[str, LessonPlace], list[float]] = {}
            over = threading.Event()
            threading.Thread(target=_follow, args=(server, runs, over), daemon=True).start()
            while sys.stdin.readline():
                ended = {each: times for each, times in runs.items() if len(times) == 3}
                factors = [duration / (end - begin) for begin, end, duration in ended.values()]
                _tell({"factors": [round(each, 3) for each in factors], "busy": time.process_time()})
            over.set()
        finally:
            server.close()


def _follow(
    server: PageServer, runs: dict[tuple[str, LessonPlace], list[float]], over: threading.Event
) -> None:
    """Notes when the run of each learner begins and ends, to 0.02 s, and how long it is in simulated time."""
    while not over.wait(0.02):
        for learner in server.sessions.learners:
            lecture = learner.lecture
            if lecture is None:
                continue
            times = runs.setdefault((learner.token, lecture.exercise), [])
            if lecture.phase == "running" and not times:
                # A report is up to 0.1 s old, and tells how far the run was then.
                times.append(time.monotonic() - lecture.t)
            elif lecture.phase == "done" and len(times) == 1:
                times += [time.monotonic(), lecture.t]


def _tell(found: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(found) + "\n")
    sys.stdout.flush()


class Host:
    """One server in a process of its own."""

    def __init__(self, learners: int, lesson: str) -> None:
        self._process = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "benchmarks.rehearsal",
                "--be-a-server",
                str(learners),
                "--lesson",
                lesson,
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.links: dict[str, str] = self._hear()

    def _hear(self) -> Any:
        assert self._process.stdout is not None
        return json.loads(self._process.stdout.readline())

    def report(self) -> dict[str, Any]:
        """What the server tells now, see `be_a_server`."""
        assert self._process.stdin is not None
        self._process.stdin.write("now\n")
        self._process.stdin.flush()
        return self._hear()

    def close(self) -> None:
        """Ends the server."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        try:
            self._process.wait(30.0)
        except subprocess.TimeoutExpired:
            self._process.kill()


# ------------------------------------------------------------------ the people


class Learner(Wire):
    """A learner's page."""

    def _take(self, message: dict[str, Any]) -> None:
        if message["type"] == "ResetGuiMessage":
            self.controls.clear()
        super()._take(message)

    def waits_for(self, condition: Callable[[], object]) -> float:
        """The time until a condition holds, s."""
        began = time.monotonic()
        while True:
            with contextlib.suppress(RuntimeError):  # the page changes while it is read
                if condition():
                    return time.monotonic() - began
            if time.monotonic() - began > LONG:
                raise TimeoutError("a learner waits for too long")
            time.sleep(0.02)

    def use(self, label: str, value: object) -> None:
        """Uses a control by its label, once the page has it."""
        self.waits_for(lambda: self.find(label))
        found = self.find(label)
        assert found is not None
        self.write(found, value=value)


class Teacher:
    """A teacher's page. told: the latest of each part of what it shows."""

    def __init__(self, link: str) -> None:
        self._line = connect(link.replace("http", "ws", 1), max_size=None, ping_interval=None)
        self.told: dict[str, Any] = {}
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.send(do="here", address="")

    def _read(self) -> None:
        with contextlib.suppress(Exception):
            for text in self._line:
                self.told |= json.loads(text)

    def send(self, **message: object) -> None:
        """Presses a button."""
        self._line.send(json.dumps(message))

    def close(self) -> None:
        """Closes the page."""
        self._line.close()
        self._reader.join(5.0)


# ------------------------------------------------------------------ the rehearsal


def rehearsed(learners: int, phones: int, lesson: str) -> dict[str, Any]:
    """Everything that was measured; learners, phones: on each server."""
    hosts = [Host(learners, lesson) for _ in range(SERVERS)]
    try:
        with _people(hosts, learners, phones) as (pages, crowds, teachers):
            return _lecture(hosts, pages, crowds, teachers, lesson, learners + phones)
    finally:
        for host in hosts:
            host.close()


@contextlib.contextmanager
def _people(
    hosts: Sequence[Host], learners: int, phones: int
) -> Iterator[tuple[list[Learner], list[Crowd], list[Teacher]]]:
    with contextlib.ExitStack() as all_leave:
        teachers = [Teacher(host.links["teacher"]) for host in hosts]
        for teacher in teachers:
            all_leave.callback(teacher.close)
        links = [host.links["learners"] for host in hosts for _ in range(learners)]
        pages = [Learner(link) for link in links]
        for page in pages:
            all_leave.enter_context(page)
        crowds = [
            all_leave.enter_context(Crowd("--phones", str(phones), "--at", host.links["phones"]))
            for host in hosts
        ]
        for crowd in crowds:
            crowd.hear()
            crowd.go_on()  # begins to count pictures,
            crowd.go_on()  # and ends that; from now on, each line is a vote
            crowd.hear()
        yield pages, crowds, teachers


def _lecture(
    hosts: Sequence[Host],
    pages: Sequence[Learner],
    crowds: Sequence[Crowd],
    teachers: Sequence[Teacher],
    lesson: str,
    each: int,
) -> dict[str, Any]:
    waits: Waits = {}
    lost: list[str] = []
    for k, page in enumerate(pages):
        page.use("Your name", f"learner {k}")
    began, busy = time.monotonic(), [host.report()["busy"] for host in hosts]
    own = time.process_time()
    steps = LessonPlace(lesson).whole.steps
    for place, step in enumerate(steps):
        title = f"{place + 1} {step.title}"
        for teacher in teachers:
            teacher.send(do="go", lesson=lesson, place=place)
        _all(waits, "step on the page", pages, lambda page, title=title: page.shows(title) and _ready(page))
        for number in (1, 2) if isinstance(step.prediction, (Choice, Value)) else ():
            for teacher in teachers:
                teacher.send(do="press", button="open")
            says = "Vote:" if number == 1 else "Second vote:"
            _all(waits, "vote on the page", pages, lambda page, says=says: page.shows(says))
            for k, page in enumerate(pages):
                _vote(page, step.prediction, k + number)
            for crowd in crowds:
                crowd.go_on()
            waits.setdefault("phone's vote", []).extend(1e-3 * crowd.hear()["longest_ms"] for crowd in crowds)
            since = time.monotonic()
            for teacher in teachers:
                while teacher.told["all"]["voted"] < each and time.monotonic() < since + 20.0:
                    time.sleep(0.02)
            waits.setdefault("votes counted", []).append(time.monotonic() - since)
            lost += [
                f"step {place + 1}, vote {number}: {teacher.told['all']['voted']} of {each}"
                for teacher in teachers
                if teacher.told["all"]["voted"] != each
            ]
            for teacher in teachers:
                teacher.send(do="press", button="close")
            _all(waits, "bars on the page", pages, lambda page: page.shows("The vote is closed"))
        for teacher in teachers:
            teacher.send(do="press", button="run")
        _all(waits, "run on the page", pages, lambda page: page.shows("DONE"))
    minutes = (time.monotonic() - began) / 60
    lost += [
        f"learner {row['number']}: {row['done']} of {len(steps)} steps"
        for teacher in teachers
        for row in _rows(teacher, len(steps))
        if row["done"] != len(steps)
    ]
    reports = [host.report() for host in hosts]
    used = [now["busy"] - then for now, then in zip(reports, busy, strict=True)]
    clients = time.process_time() - own
    factors = [factor for report in reports for factor in report["factors"]]
    lost += _handed_in(pages, waits, lesson, len(steps))
    return {
        "learners": len(pages),
        "votes_per_server": each,
        "cores": psutil.cpu_count(),
        "load_average": round(psutil.getloadavg()[0], 1),
        "minutes": round(minutes, 2),
        "server_shares": [round(one / 60 / minutes, 3) for one in used],
        "clients_share": round(clients / 60 / minutes, 3),
        "real_time_factors": {"runs": len(factors), **_figures(factors)},
        "waits": {name: _figures(times) for name, times in waits.items()},
        "lost": lost,
    }


def _ready(page: Learner) -> bool:
    """Whether the step on the page can be run, or asks for a prediction first."""
    labels = ("Run this step", "Run (first say what you expect)")
    return any(page.find(label) for label in labels) and not page.shows("DONE")


def _all(waits: Waits, name: str, pages: Sequence[Learner], shows: Callable[[Learner], object]) -> None:
    """Notes how long each page takes until it shows something."""
    times: list[float] = []

    def wait(page: Learner) -> None:
        times.append(page.waits_for(lambda: shows(page)))

    threads = [threading.Thread(target=wait, args=(page,)) for page in pages]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(times) == len(pages), f"{name}: {len(pages) - len(times)} learners waited in vain"
    waits.setdefault(name, []).extend(times)
    print(f"{name}: {max(times):.1f} s", file=sys.stderr, flush=True)


def _vote(page: Learner, asked: object, number: int) -> None:
    if isinstance(asked, Choice):
        page.use("I expect", "ABCDEFG"[number % len(asked.options)])
    elif isinstance(asked, Value):
        page.use("My guess", STEPS // 2 + 1 + number % 7)  # the middle is where the slider begins


def _rows(teacher: Teacher, steps: int) -> list[dict[str, Any]]:
    end = time.monotonic() + 5.0
    while time.monotonic() < end and any(row["done"] < steps for row in teacher.told["class"]["rows"]):
        time.sleep(0.05)
    return teacher.told["class"]["rows"]


def _handed_in(pages: Sequence[Learner], waits: Waits, lesson: str, steps: int) -> list[str]:
    """Lets every learner hand in, grades all texts, and returns what is missing in them."""
    lost: list[str] = []
    for page in pages:
        page.waits_for(lambda page=page: page.find("Write the text"))
        found = page.find("Write the text")
        assert found is not None
        page.write(found, value=True)
    _all(waits, "text to hand in", pages, lambda page: page.find("To hand in") and _text(page))
    with tempfile.TemporaryDirectory() as folder:
        key = Path(folder) / "key.txt"
        key.write_text(KEY)
        began = time.monotonic()
        for k, page in enumerate(pages):
            file, out = Path(folder) / f"{k}.txt", Path(folder) / f"{k}.json"
            file.write_text(_text(page))
            with contextlib.redirect_stdout(io.StringIO()):
                code = himpc_lab(["grade", str(file), "--key", str(key), "--json", str(out)])
            found = json.loads(out.read_text())
            ran = next((each["steps"] for each in found["lessons"] if each["lesson"] == lesson), [])
            if code != 0 or len(ran) != steps:
                lost.append(f"text of learner {k}: exit code {code}, steps {ran}")
        waits["grading of all"] = [time.monotonic() - began]
    return lost


def _text(page: Learner) -> str:
    found = page.find("To hand in")
    control = None if found is None else page.controls.get(found)
    return "" if control is None else str(control.get("value", ""))


def _figures(values: Sequence[float]) -> dict[str, float]:
    if not values:
        return {}
    return {name: round(of(values), 3) for name, of in (("least", min), ("median", median), ("most", max))}


def table(found: dict[str, Any]) -> str:
    """The results as text."""
    waits = "\n".join(
        f"  {name:18} median {each['median']:7.2f}   longest {each['most']:7.2f}"
        for name, each in found["waits"].items()
    )
    factors = found["real_time_factors"]
    return (
        f"{found['learners']} learners on {SERVERS} servers, {found['cores']} cores, load average "
        f"{found['load_average']}, {found['minutes']} minutes\n"
        f"servers: {found['server_shares']} of a core; all clients: {found['clients_share']}\n"
        f"simulated over real time in {factors['runs']} runs: least {factors['least']}, median "
        f"{factors['median']}\nwaiting times, s:\n{waits}\nlost: {found['lost'] or 'nothing'}"
    )


if __name__ == "__main__":
    sys.exit(main())
