"""Rehearses a class: learners with robots of their own, and phones, go through a lesson.

    python -m benchmarks.rehearsal [--learners 20] [--phones 200] [--lesson L] [--json -]

The class goes to each step of the lesson, votes, votes again, and runs the step on all robots. Then every
learner hands in, and all texts are graded. Learners and phones use the protocol of their pages and draw
nothing. The exit code is 0 if no vote, step or text was lost. Waiting times and real-time factors depend on
the cores and on their other load. They are printed, but they do not change the exit code.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import psutil

from app.__main__ import main as himpc_lab
from app.link.exercise import LessonPlace
from app.panels.widgets.controls import STEPS
from benchmarks.phones import Crowd
from benchmarks.rehearsal_host import KEY, Host
from benchmarks.rehearsal_people import Learner, Teacher
from lessons.teaching.prediction import Choice, Value

Waits = dict[str, list[float]]


def main() -> int:
    """Measures as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--learners", type=int, default=20)
    parser.add_argument("--phones", type=int, default=200)
    parser.add_argument("--lesson", default="a-redundant-arm")
    parser.add_argument("--json", choices=["-"], default=None)
    options = parser.parse_args()
    found = rehearsed(options.learners, options.phones, options.lesson)
    print(json.dumps(found, indent=1) if options.json else table(found))
    return 1 if found["lost"] else 0


# ------------------------------------------------------------------ the rehearsal


def rehearsed(learners: int, phones: int, lesson: str) -> dict[str, Any]:
    """Returns everything that was measured."""
    host = Host(learners, lesson)
    try:
        with _people(host, learners, phones) as (pages, crowd, teacher):
            return _lecture(host, pages, crowd, teacher, lesson, len(pages) + phones)
    finally:
        host.close()


@contextlib.contextmanager
def _people(host: Host, learners: int, phones: int) -> Iterator[tuple[list[Learner], Crowd, Teacher]]:
    with contextlib.ExitStack() as all_leave:
        teacher = Teacher(host.links["teacher"])
        all_leave.callback(teacher.close)
        pages = [Learner(host.links["learners"]) for _ in range(learners)]
        for page in pages:
            all_leave.enter_context(page)
        for page in pages:
            page.waits_for(lambda page=page: page.find("Your name"))
        crowd = Crowd("--phones", str(phones), "--at", host.links["phones"])
        all_leave.enter_context(crowd)
        crowd.hear()
        crowd.go_on()  # begins the counting of pictures
        crowd.go_on()  # ends the counting; from now on, each line is a vote
        crowd.hear()
        yield pages, crowd, teacher


def _lecture(
    host: Host,
    pages: Sequence[Learner],
    crowd: Crowd,
    teacher: Teacher,
    lesson: str,
    everybody: int,
) -> dict[str, Any]:
    waits: Waits = {}
    lost: list[str] = []
    for k, page in enumerate(pages):
        page.use("Your name", f"learner {k}")
    began, before = time.monotonic(), host.report()
    own = time.process_time()
    steps = LessonPlace(lesson).whole.steps
    for place, step in enumerate(steps):
        title = f"{place + 1} {step.title}"
        teacher.send(do="go", lesson=lesson, place=place)
        _all(waits, "step on the page", pages, lambda page, title=title: page.shows(title) and _ready(page))
        for number in (1, 2) if isinstance(step.prediction, (Choice, Value)) else ():
            teacher.send(do="press", button="open")
            says = "Vote:" if number == 1 else "Second vote:"
            _all(waits, "vote on the page", pages, lambda page, says=says: page.shows(says))
            for k, page in enumerate(pages):
                _vote(page, step.prediction, k + number)
            crowd.go_on()
            waits.setdefault("phone's vote", []).append(1e-3 * crowd.hear()["longest_ms"])
            since = time.monotonic()
            while teacher.told["all"]["voted"] < everybody and time.monotonic() < since + 20.0:
                time.sleep(0.02)
            waits.setdefault("votes counted", []).append(time.monotonic() - since)
            voted = teacher.told["all"]["voted"]
            if voted != everybody:
                lost.append(f"step {place + 1}, vote {number}: {voted} of {everybody}")
            teacher.send(do="press", button="close")
            _all(waits, "bars on the page", pages, lambda page: page.shows("The vote is closed"))
        teacher.send(do="press", button="run")
        _all(waits, "run on the page", pages, lambda page: page.shows("DONE"))
    minutes = (time.monotonic() - began) / 60
    lost += [
        f"learner {row['number']}: {row['done']} of {len(steps)} steps"
        for row in _rows(teacher, len(steps))
        if row["done"] != len(steps)
    ]
    report = host.report()
    used, robots = (report[what] - before[what] for what in ("busy", "robots"))
    clients = time.process_time() - own
    factors = report["factors"]
    lost += _handed_in(pages, waits, lesson, len(steps))
    return {
        "learners": len(pages),
        "voters": everybody,
        "cores": psutil.cpu_count(),
        "load_average": round(psutil.getloadavg()[0], 1),
        "minutes": round(minutes, 2),
        "server_share": round(used / 60 / minutes, 3),
        "robots_share": round(robots / 60 / minutes, 3),
        "clients_share": round(clients / 60 / minutes, 3),
        "real_time_factors": {"runs": len(factors), **_figures(factors)},
        "waits": {name: _figures(times) for name, times in waits.items()},
        "lost": lost,
    }


def _ready(page: Learner) -> bool:
    """Returns whether the page shows a step that was not run yet and that has a button to run it."""
    labels = ("Run this step", "Run (answer first)")
    return any(page.find(label) for label in labels) and not page.shows("DONE")


def _all(waits: Waits, name: str, pages: Sequence[Learner], shows: Callable[[Learner], object]) -> None:
    """Measures the time that each page needs until it shows something."""
    times: list[float] = []

    def wait(page: Learner) -> None:
        times.append(page.waits_for(lambda: shows(page)))

    threads = [threading.Thread(target=wait, args=(page,)) for page in pages]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(times) == len(pages), f"{name}: {len(pages) - len(times)} learners waited too long"
    waits.setdefault(name, []).extend(times)
    print(f"{name}: {max(times):.1f} s", file=sys.stderr, flush=True)


def _vote(page: Learner, asked: object, number: int) -> None:
    if isinstance(asked, Choice):
        place = number % len(asked.options)
        page.use(f"{'ABCDEFG'[place]}   {asked.options[place].text}", True)
    elif isinstance(asked, Value):
        page.use("My guess", STEPS // 2 + 1 + number % 7)  # the slider begins in the middle


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
    """Returns the results as text."""
    waits = "\n".join(
        f"  {name:18} median {each['median']:7.2f}   longest {each['most']:7.2f}"
        for name, each in found["waits"].items()
    )
    factors = found["real_time_factors"]
    return (
        f"{found['learners']} learners, {found['cores']} cores, load average "
        f"{found['load_average']}, {found['minutes']} minutes\n"
        f"server: {found['server_share']} of a core; all robots: {found['robots_share']}; all clients: "
        f"{found['clients_share']}\n"
        f"simulated over real time in {factors['runs']} runs: least {factors['least']}, median "
        f"{factors['median']}\nwaiting times, s:\n{waits}\nlost: {found['lost'] or 'nothing'}"
    )


if __name__ == "__main__":
    sys.exit(main())
