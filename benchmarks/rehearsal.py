"""Rehearses a class: learners with robots of their own, and phones, go through a lesson.

    python -m benchmarks.rehearsal [--learners 20] [--phones 200] [--lesson L]

The class goes to each step of the lesson, votes, votes again, and runs the step on all robots. Then every
learner hands in, and all texts are graded. Learners and phones use the protocol of their pages and draw
nothing; the server and the phones have processes of their own. The program prints JSON: waiting times, s, and
shares of a core. The exit code is 0 if no vote, step or text was lost. Waiting times and real-time factors
depend on the cores and on their other load. They are printed, but they do not change the exit code.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import json
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from math import sqrt
from pathlib import Path
from statistics import median
from typing import Any

import psutil
import tyro
from websockets.asyncio.client import ClientConnection
from websockets.asyncio.client import connect as joined
from websockets.sync.client import connect

from app.__main__ import main as himpc_lab
from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from app.panels.widgets.controls import STEPS
from app.tab.in_view import AWAKE, LABEL
from app.web.server import PageServer, ServerOptions
from benchmarks.child import Child, tell
from browsing.wire import Wire, eventually
from lessons.replay.progress import read_key
from lessons.teaching.prediction import Choice, Value

KEY = "a key of a rehearsal"
LONG = 300.0  # s


def main(
    learners: int = 20, phones: int = 200, lesson: str = "a-redundant-arm", serve: bool = False,
    at: str | None = None,
) -> int:  # fmt: skip
    """Does what the module says."""
    if at is not None:
        asyncio.run(be_phones(at, phones))
        return 0
    if serve:
        be_a_server(learners, lesson)
        return 0
    size = ("--learners", str(learners), "--lesson", lesson)
    with contextlib.ExitStack() as all_leave:
        host = all_leave.enter_context(Child("benchmarks.rehearsal", "--serve", *size))
        links = host.hear("teacher")
        teacher = all_leave.enter_context(Teacher(links["teacher"]))
        pages = [all_leave.enter_context(Learner(links["learners"])) for _ in range(learners)]
        for k, page in enumerate(pages):
            page.use("Your name", f"learner {k}")
        voters = all_leave.enter_context(crowd(links["phones"], phones))
        found = Rehearsal(host, pages, voters, teacher, lesson, len(pages) + phones).held()
    print(json.dumps(found, indent=1))
    return 1 if found["lost"] else 0


# ------------------------------------------------------------------ the pages


class Learner(Wire):
    """A learner's page."""

    longest_wait = LONG

    def _take(self, message: dict[str, Any]) -> None:
        super()._take(message)
        if message["type"] == "GuiTextMessage" and message["props"]["label"] == LABEL:
            self.write(message["uuid"], value=AWAKE)  # a browser shows only the curves of the step

    @property
    def ready(self) -> bool:
        """Whether the page shows a step that was not run yet and that has a button to run it."""
        labels = ("Run this step", "Run (answer first)")
        return any(self.find(label) for label in labels) and not self.shows("DONE")

    @property
    def text(self) -> str:
        """The text to hand in."""
        control = self.controls.get(self.find("To hand in") or "")
        return "" if control is None else str(control.get("value", ""))


class Teacher(contextlib.AbstractContextManager["Teacher"]):
    """A teacher's page. told: the latest value of each part that the page shows."""

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

    def __exit__(self, *_: object) -> None:
        self._line.close()
        self._reader.join(5.0)


# ------------------------------------------------------------------ the phones


async def be_phones(address: str, count: int) -> None:
    """Connects all phones. Each line on stdin lets all phones vote, after which a line with the longest
    waiting time is printed."""
    phones = await asyncio.gather(*(Phone.open(address, k) for k in range(count)))
    tell(phones=len(phones))
    while await asyncio.to_thread(sys.stdin.readline):
        waits = await asyncio.gather(*(phone.vote() for phone in phones))
        tell(longest_s=round(max(waits), 3))


class Phone:
    """A phone."""

    def __init__(self, line: ClientConnection, number: int) -> None:
        self._line, self._number = line, number
        self._asked: dict[str, Any] = {}
        self._answer: asyncio.Future[None] | None = None
        self._reader = asyncio.ensure_future(self._read())

    @classmethod
    async def open(cls, address: str, number: int) -> Phone:
        """Returns a phone that has sent its first message."""
        await asyncio.sleep(0.01 * number)
        line = await joined(address, max_size=None, open_timeout=LONG, ping_interval=None)
        await line.send('{"do":"hello"}')
        await line.recv()
        return cls(line, number)

    async def _read(self) -> None:
        async for text in self._line:
            told = json.loads(text)
            self._asked = told.get("all", {}).get("asked") or self._asked
            if "say" in told and self._answer is not None and not self._answer.done():
                self._answer.set_result(None)

    async def vote(self) -> float:
        """Votes. Returns the time until the answer, s."""
        self._answer = asyncio.get_running_loop().create_future()
        began = time.monotonic()
        options, scale = self._asked.get("options"), self._asked.get("scale")
        answer = self._number % len(options or (0,)) if scale is None else sqrt(scale["low"] * scale["high"])
        await self._line.send(json.dumps({"do": "vote", "answer": answer}))
        await self._answer
        return time.monotonic() - began


def crowd(address: str, count: int) -> Child:
    """Returns phones in a process of their own that have joined a class."""
    phones = Child("benchmarks.rehearsal", "--phones", str(count), "--at", address)
    assert phones.hear("phones")["phones"] == count
    return phones


# ------------------------------------------------------------------ the server


def be_a_server(learners: int, lesson: str) -> None:
    """Serves a class, and prints its own addresses. For each line on stdin it prints the real-time factor of
    each learner's run, and the processor time that the server and the robots have used so far, s."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "key.txt").write_text(KEY)
        # A robot that waits for its step needs no processor.
        server = PageServer(
            SceneChoice.opening(lesson),
            ServerOptions(port=0, max_sessions=learners, key=read_key(f"{folder}/key.txt"), class_names=True,
                          grace=60.0),
        )  # fmt: skip
        over, runs = threading.Event(), defaultdict[tuple[str, LessonPlace], list[float]](list)
        try:
            assert server.hall is not None
            phones = f"{server.url.replace('http', 'ws')}/v/{server.hall.code}"
            tell(learners=server.guest_link, teacher=server.teachers_link, phones=phones)
            threading.Thread(target=follow, args=(server, runs, over), daemon=True).start()
            while sys.stdin.readline():
                ended = [times for times in list(runs.values()) if len(times) == 3]
                factors = [round(duration / (end - begin), 3) for begin, end, duration in ended]
                used = [psutil.Process(each.pid).cpu_times() for each in server.sessions.learners if each.pid]
                robots = sum(each.user + each.system for each in used)
                tell(factors=factors, robots=robots, busy=time.process_time())
        finally:
            over.set()
            server.close()


def follow(
    server: PageServer, runs: dict[tuple[str, LessonPlace], list[float]], over: threading.Event
) -> None:
    """Records when each learner's run begins and ends (accuracy 0.02 s), and its simulated duration."""
    while not over.wait(0.02):
        for learner in server.sessions.learners:
            lecture = learner.lecture
            if lecture is None:
                continue
            times = runs[learner.token, lecture.exercise]
            if lecture.phase == "running" and not times:
                # A report is up to 0.1 s old, and contains the time of the run at that moment.
                times.append(time.monotonic() - lecture.t)
            elif lecture.phase == "done" and len(times) == 1:
                times += [time.monotonic(), lecture.t]


# ------------------------------------------------------------------ the rehearsal


class Rehearsal:
    """One class. waits: the waiting times, s; lost: what did not arrive."""

    def __init__(
        self, host: Child, pages: Sequence[Learner], phones: Child, teacher: Teacher, lesson: str, voters: int
    ) -> None:
        self._host, self._pages, self._phones, self._teacher = host, pages, phones, teacher
        self._lesson, self._voters = lesson, voters
        self.waits = defaultdict[str, list[float]](list)
        self.lost: list[str] = []

    def held(self) -> dict[str, Any]:
        """Holds the class, and returns everything that was measured."""
        before, began, own = self._report(), time.monotonic(), time.process_time()
        steps = LessonPlace(self._lesson).whole.steps
        for place, step in enumerate(steps):
            title = f"{place + 1} {step.title}"
            self._teacher.send(do="go", lesson=self._lesson, place=place)
            self._all("step on the page", lambda page, title=title: page.shows(title) and page.ready)
            for number in (1, 2) if isinstance(step.prediction, (Choice, Value)) else ():
                self._ballot(place, number, step.prediction)
            self._press("run")
            self._all("run on the page", lambda page: page.shows("DONE"))
        seconds = time.monotonic() - began
        eventually(lambda: all(row["done"] == len(steps) for row in self._rows), 5.0)
        done = {row["number"]: row["done"] for row in self._rows}
        self.lost += [f"learner {k}: {n} of {len(steps)} steps" for k, n in done.items() if n != len(steps)]
        after = self._report()
        used = (after["busy"] - before["busy"], after["robots"] - before["robots"], time.process_time() - own)
        self._hand_in(len(steps))
        return {
            "learners": len(self._pages),
            "voters": self._voters,
            "cores": psutil.cpu_count(),
            "load_average": round(psutil.getloadavg()[0], 1),
            "minutes": round(seconds / 60, 2),
            "shares": dict(
                zip(("server", "robots", "clients"), (round(each / seconds, 3) for each in used), strict=True)
            ),
            "real_time_factors": {"runs": len(after["factors"]), **figures(after["factors"])},
            "waits": {name: figures(times) for name, times in self.waits.items()},
            "lost": self.lost,
        }

    def _report(self) -> dict[str, Any]:
        self._host.say()
        return self._host.hear("busy")

    @property
    def _rows(self) -> list[dict[str, Any]]:
        return self._teacher.told["class"]["rows"]

    def _press(self, button: str) -> None:
        self._teacher.send(do="press", button=button)

    def _ballot(self, place: int, number: int, asked: object) -> None:
        """Lets everybody vote."""
        self._press("open")
        says = "Vote:" if number == 1 else "Second vote:"
        self._all("vote on the page", lambda page: page.shows(says))
        for k, page in enumerate(self._pages, start=number):
            if isinstance(asked, Choice):
                option = k % len(asked.options)
                page.use(f"{'ABCDEFG'[option]}   {asked.options[option].text}", True)
            elif isinstance(asked, Value):
                page.use("My guess", STEPS // 2 + 1 + k % 7)  # the slider begins in the middle
        self._phones.say()
        self.waits["phone's vote"].append(self._phones.hear("longest_s")["longest_s"])
        since, told = time.monotonic(), self._teacher.told
        eventually(lambda: told["all"]["voted"] >= self._voters, 20.0)
        self.waits["votes counted"].append(time.monotonic() - since)
        if (voted := told["all"]["voted"]) != self._voters:
            self.lost.append(f"step {place + 1}, vote {number}: {voted} of {self._voters}")
        self._press("close")
        self._all("bars on the page", lambda page: page.shows("The vote is closed"))

    def _all(self, name: str, shows: Callable[[Learner], object]) -> None:
        """Measures the time that each page needs until it shows something."""
        began, times = time.monotonic(), list[float]()

        def wait(page: Learner) -> None:
            if eventually(lambda: bool(shows(page)), LONG):
                times.append(time.monotonic() - began)

        threads = [threading.Thread(target=wait, args=(page,)) for page in self._pages]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        missing = len(self._pages) - len(times)
        assert not missing, f"{name}: {missing} learners waited too long"
        self.waits[name] += times
        print(f"{name}: {max(times):.1f} s", file=sys.stderr, flush=True)

    def _hand_in(self, steps: int) -> None:
        """Lets every learner hand in, and grades all texts."""
        for page in self._pages:
            page.use("Write the text", True)
        self._all("text to hand in", lambda page: page.text)
        with tempfile.TemporaryDirectory() as folder:
            key = Path(folder) / "key.txt"
            key.write_text(KEY)
            began = time.monotonic()
            for k, page in enumerate(self._pages):
                file, out = Path(folder) / f"{k}.txt", Path(folder) / f"{k}.json"
                file.write_text(page.text)
                with contextlib.redirect_stdout(io.StringIO()):
                    code = himpc_lab(["grade", str(file), "--key", str(key), "--json", str(out)])
                lessons = {each["lesson"]: each["steps"] for each in json.loads(out.read_text())["lessons"]}
                ran = lessons.get(self._lesson, [])
                if code != 0 or len(ran) != steps:
                    self.lost.append(f"text of learner {k}: exit code {code}, steps {ran}")
            self.waits["grading of all"] = [time.monotonic() - began]


def figures(values: Sequence[float]) -> dict[str, float]:
    """Returns the least, the median and the largest value."""
    if not values:
        return {}
    return {name: round(of(values), 3) for name, of in (("least", min), ("median", median), ("most", max))}


if __name__ == "__main__":
    sys.exit(tyro.cli(main, description=__doc__))
