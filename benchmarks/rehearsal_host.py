"""A server of the rehearsal in a process of its own, see `benchmarks.rehearsal`."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import psutil

from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from app.web.server import PageServer
from lessons.replay.progress import read_key

KEY = "a key of a rehearsal"


def be_a_server(learners: int, lesson: str) -> None:
    """Serves a class. The process prints its own addresses. For each line
    on stdin it prints the real-time factor of each learner's run, and the processor time that the server and
    the robots have used so far, s."""
    with tempfile.TemporaryDirectory() as folder:
        key = Path(folder) / "key.txt"
        key.write_text(KEY)
        choice = SceneChoice.opening(lesson)  # a robot that waits for its step needs no processor
        server = PageServer(
            choice,
            port=0,
            max_sessions=learners,
            key=read_key(str(key)),
            class_names=True,
            grace=60.0,
        )
        try:
            assert server.hall is not None
            phones = f"{server.url.replace('http', 'ws')}/v/{server.hall.code}"
            _tell({"learners": server.guest_link, "teacher": server.teachers_link, "phones": phones})
            runs: dict[tuple[str, LessonPlace], list[float]] = {}
            over = threading.Event()
            threading.Thread(target=_follow, args=(server, runs, over), daemon=True).start()
            while sys.stdin.readline():
                ended = {each: times for each, times in runs.items() if len(times) == 3}
                factors = [duration / (end - begin) for begin, end, duration in ended.values()]
                robots = _processor_time(server)
                told = {"factors": [round(each, 3) for each in factors], "robots": robots}
                _tell({**told, "busy": time.process_time()})
            over.set()
        finally:
            server.close()


def _processor_time(server: PageServer) -> float:
    """Returns the processor time that the learners' robots have used, s."""
    times = [psutil.Process(each.pid).cpu_times() for each in server.sessions.learners if each.pid]
    return sum(each.user + each.system for each in times)


def _follow(
    server: PageServer, runs: dict[tuple[str, LessonPlace], list[float]], over: threading.Event
) -> None:
    """Records when each learner's run begins and ends (accuracy 0.02 s), and its simulated duration."""
    while not over.wait(0.02):
        for learner in server.sessions.learners:
            lecture = learner.lecture
            if lecture is None:
                continue
            times = runs.setdefault((learner.token, lecture.exercise), [])
            if lecture.phase == "running" and not times:
                # A report is up to 0.1 s old, and contains the time of the run at that moment.
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
            [sys.executable, "-m", "benchmarks.rehearsal_host", str(learners), lesson],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.links: dict[str, str] = self._hear()

    def _hear(self) -> Any:
        assert self._process.stdout is not None
        return json.loads(self._process.stdout.readline())

    def report(self) -> dict[str, Any]:
        """Returns the present report of the server, see `be_a_server`."""
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


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("learners", type=int)
    parser.add_argument("lesson")
    given = parser.parse_args()
    be_a_server(given.learners, given.lesson)
