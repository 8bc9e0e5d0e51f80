"""Disturbs the page: simulations are killed, stopped, or hang while they load; uploads are large, and memory
is small.

    python -m benchmarks.rough [--kills 100] [--stops 20] [--shm 8]

Two pages without a browser share a server and are disturbed; a third page only watches. If root runs the
program, it has `--shm` MB of shared memory (a mount of its own). It prints JSON: how often a page recovered
with its button, the longest time in which the watching page received nothing, the longest response time of a
GET, and what was left behind. The exit code is 0 if every page recovered and nothing was left behind.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import tyro

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import psutil
from viser import _messages
from websockets.exceptions import ConnectionClosed

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.web.server import PageServer
from browsing.wire import Wire, eventually, let_in
from lessons.scenes.run_spec import RunSpec

LONG = 60.0  # s
UPLOAD = 40_000_000  # bytes
_PART = 500_000
_REFUSED = "refused in one sentence"
_INSIDE = "HIMPC_LAB_ROUGH_INSIDE"


def main(kills: int = 100, stops: int = 20, shm: int = 8) -> int:
    """Does what the module says."""
    if _INSIDE not in os.environ and os.geteuid() == 0 and shutil.which("unshare"):
        mount = f"mount -t tmpfs -o size={shm}m tmpfs /dev/shm"
        command = ["unshare", "--mount", "sh", "-c", f'{mount} && exec "$@"', "sh", sys.executable, "-m"]
        return subprocess.call(
            [*command, "benchmarks.rough", *sys.argv[1:]], env={**os.environ, _INSIDE: "1"}
        )
    found = treat(kills, stops)
    print(json.dumps(found, indent=1))
    sound = found["recovered"] == found["treated"] and not found["left behind"]
    return 0 if sound else 1


def treat(kills: int, stops: int, scene: str = "iiwa14-hold") -> dict[str, object]:
    """Does all disturbances in sequence, see the module. scene: the scene that the pages show."""
    shared = shutil.disk_usage("/dev/shm").total if os.path.exists("/dev/shm") else 0
    before, there = _memory_left(), _children()
    server = PageServer(SceneChoice(RunSpec(scene)), port=0, max_sessions=3)
    found: dict[str, object] = {"shared memory MB": round(shared / 1e6, 1)}
    treated = recovered = 0
    with contextlib.closing(server), contextlib.ExitStack() as opened:
        # The pages open one after the other, so that the processes of each are known.
        pairs = [(opened.enter_context(Wire(server.link)), _learner(server, place)) for place in range(3)]
        (witness, *wires), learners = zip(*pairs, strict=True)
        assert eventually(lambda: all(map(_runs, learners)), LONG), "the pages do not start"
        pages = list(zip(learners[1:], wires, strict=True))
        with _watch(server.link, witness) as worst:
            for name, times, harm in (
                ("killed", kills, lambda each: _hurt(each, signal.SIGKILL)),
                ("stopped", stops, lambda each: _hurt(each, signal.SIGSTOP)),
                ("load that hangs", 2, _hang),
            ):
                good = sum(_recovers(*pages[k % 2], harm, by_reset=bool(k // 2 % 2)) for k in range(times))
                found[name] = f"{good} of {times} recovered"
                treated, recovered = treated + times, recovered + good
            with ThreadPoolExecutor() as uploads:
                answers = list(uploads.map(_upload, wires))
            found["uploads of 40 MB"] = ", ".join(answers)
            treated += 2
            recovered += answers.count(_REFUSED) if _runs(learners[0]) else 0

    eventually(lambda: not _children() - there, 5.0)
    return found | {
        "treated": treated,
        "recovered": recovered,
        "longest silence of the watching page s": round(worst[0], 2),
        "longest GET s": round(worst[1], 2),
        "left behind": [f"process {child.pid}" for child in _children() - there]
        + sorted(_memory_left() - before),
    }


def _learner(server: PageServer, place: int) -> SimulationClient:
    assert eventually(lambda: len(server.sessions.learners) > place, LONG)
    return server.sessions.learners[place]


def _runs(learner: SimulationClient) -> bool:
    status = learner.status
    return learner.trouble() is None and status is not None and status.ticks > 5


def _hurt(learner: SimulationClient, number: signal.Signals) -> None:
    pid = learner.pid
    assert pid is not None
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, number)


def _hang(learner: SimulationClient) -> None:
    """Requests a scene that never loads: its process stops while loading."""
    _hurt(learner, signal.SIGSTOP)
    learner.load(SceneChoice(RunSpec("panda-hold")))


def _recovers(
    learner: SimulationClient, page: Wire, harm: Callable[[SimulationClient], None], by_reset: bool
) -> bool:
    """Returns whether the page reports the fault, and whether its button makes the robot run again."""

    def says() -> bool:
        return any(page.shows(badge) for badge in ("STOPPED", "SILENT", "LOADING"))

    if not eventually(lambda: not says() and _runs(learner), LONG):
        return False
    pid, ready = learner.pid, learner.ready
    harm(learner)
    if not eventually(says, LONG):
        return False
    label, value = ("Playback", "Reset all") if by_reset else ("Start again", True)
    # A page that was built anew a moment ago may not have its buttons yet.
    if not eventually(lambda: page.find(label) is not None, LONG):
        return False
    button = page.find(label)
    assert button is not None
    page.write(button, value=value)
    return eventually(lambda: learner.pid != pid and learner.ready is not ready and _runs(learner), LONG)


def _upload(page: Wire) -> str:
    """Uploads an unwanted file as fast as possible; the server may close the connection. Returns the
    response."""
    eventually(lambda: page.find("Upload a URDF") is not None, LONG)
    button = page.find("Upload a URDF")
    assert button is not None, "the page has no button to upload a robot"
    count, name = UPLOAD // _PART, f"large-{id(page)}"
    try:
        page.say(_messages.FileTransferStartUpload(button, name, "large.urdf", "text/xml", count, UPLOAD))
        for place in range(count):
            page.say(_messages.FileTransferPart(button, name, place, bytes(_PART)))
    except (ConnectionClosed, OSError):
        return "connection ended"

    def notices() -> int:
        return [title for title, _ in page.notices].count("Not uploaded")

    answered = eventually(lambda: notices() > 0, 10.0)
    return (_REFUSED if notices() == 1 else f"{notices()} notices") if answered else "no answer"


@contextlib.contextmanager
def _watch(url: str, witness: Wire) -> Iterator[list[float]]:
    """Yields (longest silence of a page, longest response time of a GET), s, during the disturbance."""
    worst, over = [0.0, 0.0], threading.Event()

    def look() -> None:
        seen, changed = dict[str, str](), time.monotonic()
        while not over.wait(0.05):
            shown = list(witness.controls.items())
            now = {uuid: str(each["props"].get("content", "")) for uuid, each in shown}
            if now != seen:
                seen, changed = now, time.monotonic()
            worst[0] = max(worst[0], time.monotonic() - changed)

    def get() -> None:
        page = urllib.request.Request(url.partition("?")[0], headers={"Cookie": let_in(url)})
        while not over.wait(0.5):
            began = time.monotonic()
            urllib.request.urlopen(page, timeout=LONG).close()
            worst[1] = max(worst[1], time.monotonic() - began)

    threads = [threading.Thread(target=each, daemon=True) for each in (look, get)]
    for each in threads:
        each.start()
    try:
        yield worst
    finally:
        over.set()
        for each in threads:
            each.join(LONG)


def _children() -> set[psutil.Process]:
    """Returns the processes below this one, without the two that Python keeps as long as this program runs:
    the fork server and the tracker of resources."""
    own, found = psutil.Process(), set[psutil.Process]()
    for child in own.children(recursive=True):
        with contextlib.suppress(psutil.NoSuchProcess):  # it has ended
            if child.ppid() != own.pid or "from multiprocessing." not in child.cmdline()[-1]:
                found.add(child)
    return found


def _memory_left() -> set[str]:
    """Returns the named shared memory that belongs to no other living program, and the rings that this
    process still maps."""
    found = {f"/dev/shm/{path.name}" for path in Path("/dev/shm").glob("*")}
    others = {line.split()[-1] for each in psutil.pids() if each != os.getpid() for line in _maps(each)}
    # The owner may have removed the name meanwhile.
    named = {name for name in found - others if os.path.exists(name)}
    return named | {line.strip() for line in _maps(os.getpid()) if "himpc-lab" in line}


def _maps(process: int) -> list[str]:
    try:
        return Path(f"/proc/{process}/maps").read_text().splitlines()
    except OSError:  # the process has ended or belongs to another user
        return []


if __name__ == "__main__":
    sys.exit(tyro.cli(main, description=__doc__))
