"""Measures whether the server's memory, threads and handles stay constant, over time and over reconnections.

    python -m benchmarks.soak [--minutes M] [--clients K] [--reconnects N] [--scene S] [--json -]

The program runs a server and, in a process of their own, K clients that use the page's protocol
(benchmarks/client.py). It measures for M minutes. In the first ten minutes (or the first half of a shorter
run) the robots run at twice the speed and fill the histories for playback and export. This phase lasts until
every robot has run for two minutes of simulated time. Then one of the clients reloads its page N times. The
program prints a table. The exit code is 0 if the memory of the server and of its children grew by at most 5 %
since the histories were full, the numbers of threads and handles are the same as before, and 100 reloads cost
at most 5 MB.

The measured memory is the memory that a process has written and does not share with other processes. Free
memory is returned to the system first. Otherwise the memory that an allocator keeps would vary by more than a
leak adds. The pages of libraries are not counted: their memory also varies, because they are shared only as
long as another program on the machine uses them.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import gc
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from pathlib import Path
from statistics import median

import psutil

from app.client.rows import MOST, RATE
from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.messages import Speed
from app.link.process import wait_until
from app.web.server import PageServer
from benchmarks.learners import LONG, Viewers, simulated
from lessons.scenes.run_spec import RunSpec

FILL = 10.0  # minutes
EVERY = 5.0  # s
NEAR = 5  # the smallest number of samples over which a median is taken
BATCHES = 5  # of reloads
REST = 5.0  # s
GROWTH = 1.05
"""Factor by which memory may grow."""
PER_100 = 5.0
"""Memory, MB, that 100 reconnections may cost."""
SPARE = 3
"""Number by which the processes, the threads or the handles may increase."""


@dataclass(frozen=True)
class Sample:
    """One measurement.

    Attributes:
        minute: time since the start.
        server, children: MB of their own memory, see `written`.
        rss: MB of the server, shared memory included.
    """

    minute: float
    server: float
    rss: float
    children: float
    processes: int
    threads: int
    handles: int


def main() -> int:
    """Runs the test as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--clients", type=int, default=8)
    parser.add_argument("--reconnects", type=int, default=100)
    parser.add_argument("--scene", default="iiwa14-hold")
    parser.add_argument("--json", choices=["-"], default=None)
    options = parser.parse_args()
    server = PageServer(SceneChoice(RunSpec(options.scene)), port=0, max_sessions=options.clients)
    try:
        with Viewers(server.link, "--clients", str(options.clients)) as viewers:
            assert wait_until(lambda: len(server.sessions.learners) == options.clients, LONG), "not let in"
            learners = server.sessions.learners
            assert wait_until(lambda: all(simulated(each) > 0.5 for each in learners), LONG), "nothing runs"
            fill = min(FILL, options.minutes / 2)
            go(learners, 2.0)
            samples = watched(fill, viewers.pid)
            while not all(simulated(each) > MOST / RATE for each in learners):
                time.sleep(EVERY)
            go(learners, 1.0)
            filled = len(samples)
            samples += watched(options.minutes - fill, viewers.pid, fill)
            cost = reconnected(viewers, options.reconnects)
    finally:
        server.close()
    faults = judged(samples[filled:], cost)
    found = {"reconnects_mb_per_100": cost, "faults": faults, "samples": [asdict(each) for each in samples]}
    print(json.dumps(found, indent=1) if options.json else table(samples, cost, faults))
    return 1 if faults else 0


def go(learners: Sequence[SimulationClient], speed: float) -> None:
    """Sets the speed of all robots, simulated seconds per second."""
    for learner in learners:
        learner.send(Speed(speed))


def reconnected(viewers: Viewers, times: int) -> float | None:
    """Returns the MB that the server keeps per hundred reloads of a page, after some reloads to warm up. This
    is the median slope between any two of several batches, because a single reading varies."""
    if not times:
        return None
    visit(viewers, max(20, times // 5))
    size, held = max(1, times // BATCHES), [rested(viewers.pid)]
    for _ in range(BATCHES):
        visit(viewers, size)
        held.append(rested(viewers.pid))
    pairs = combinations(range(len(held)), 2)
    return round(median(100 / size * (held[b] - held[a]) / (b - a) for a, b in pairs), 2)


def visit(viewers: Viewers, times: int) -> None:
    """Lets a browser reload a number of times."""
    came = viewers.reload(times)
    assert came == times, f"of {times} visits only {came} saw a robot"


def rested(client: int) -> float:
    """Returns the MB of the server after a moment without activity."""
    time.sleep(REST)
    found: list[float] = []
    for _ in range(NEAR):
        time.sleep(0.5)
        found.append(sample(0.0, client).server)
    return median(found)


def watched(minutes: float, client: int, after: float = 0.0) -> list[Sample]:
    """Returns samples over a number of minutes, or over a longer time if these are too few for a verdict.
    after: the minute of the first sample."""
    began, found = time.monotonic(), list[Sample]()
    while (minute := (time.monotonic() - began) / 60) < minutes or len(found) < 2 * NEAR:
        found.append(sample(after + minute, client))
        if len(found) % 12 == 1:  # a run takes an hour and may fail at its end
            print(json.dumps(asdict(found[-1])), file=sys.stderr, flush=True)
        time.sleep(EVERY)
    return found


def sample(minute: float, client: int) -> Sample:
    """Returns what the server and its children use now. client: id of the process that is not part of the
    server."""
    server = psutil.Process()
    tidy()
    memory = written(server)
    own, processes = 0.0, 0
    for child in server.children(recursive=True):
        if child.pid == client:
            continue
        try:
            own += written(child)
            processes += 1
        except psutil.NoSuchProcess:
            pass
    return Sample(
        minute=round(minute, 2),
        server=round(1e-6 * memory, 1),
        rss=round(1e-6 * server.memory_info().rss, 1),
        children=round(1e-6 * own, 1),
        processes=processes,
        threads=server.num_threads(),
        handles=server.num_fds(),
    )


def written(process: psutil.Process) -> float:
    """Returns the bytes that a process has written and shares with no other process."""
    if sys.platform != "linux":
        return process.memory_full_info().uss
    try:
        lines = Path(f"/proc/{process.pid}/smaps_rollup").read_text().splitlines()
    except (FileNotFoundError, ProcessLookupError):
        raise psutil.NoSuchProcess(process.pid) from None
    return 1024.0 * next(int(line.split()[1]) for line in lines if line.startswith("Private_Dirty:"))


def tidy() -> None:
    """Returns free memory to the system, if its allocator supports that."""
    gc.collect()
    with contextlib.suppress(OSError, AttributeError):  # not glibc
        ctypes.CDLL(None).malloc_trim(0)


def judged(later: list[Sample], cost: float | None) -> list[str]:
    """Returns sentences about exceeded limits. later: the samples after the histories were full."""
    if len(later) < 2 * NEAR:
        return [f"Too short: {len(later)} samples since the histories were full."]
    some = max(NEAR, len(later) // 10)  # data on the way to a client vary within minutes
    first, last = later[:some], later[-some:]
    faults: list[str] = []
    for name in ("server", "children"):
        before, after = (median(getattr(each, name) for each in part) for part in (first, last))
        if after > GROWTH * before:
            faults.append(f"Memory of the {name} grew from {before:.1f} to {after:.1f} MB.")
    for name in ("processes", "threads", "handles"):
        before, after = (median(getattr(each, name) for each in part) for part in (first, last))
        if after > before + SPARE:
            faults.append(f"There were {before:g} {name}, then {after:g}.")
    if cost is not None and cost > PER_100:
        faults.append(f"100 reconnects cost {cost:.1f} MB.")
    return faults


def table(samples: list[Sample], cost: float | None, faults: list[str]) -> str:
    """Returns a table of about thirty lines."""
    names = list(asdict(samples[0]))
    lines = ["  ".join(name.rjust(9) for name in names)]
    lines += [
        "  ".join(str(value).rjust(9) for value in asdict(each).values())
        for each in samples[:: max(1, len(samples) // 30)]
    ]
    if cost is not None:
        lines.append(f"100 reconnects: {cost:.1f} MB")
    return "\n".join([*lines, *(faults or ["No limit was exceeded."])])


if __name__ == "__main__":
    sys.exit(main())
