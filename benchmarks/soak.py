"""Measures whether the server's memory, threads and handles stay constant: over time, over reconnections, and
while learners change scenes and ghosts.

    python -m benchmarks.soak [--minutes M] [--clients K] [--reconnects N] [--scene S] [--speed X]
    python -m benchmarks.soak --every S [--minutes M] [--clients K] [--speed X] [--seed N]

The program runs a server and, in a process of their own, K clients that use the page's protocol
(benchmarks/client.py). It measures for M minutes and prints a sample a minute, and at the end faults, as
lines of JSON. The exit code is 1 if there are faults.

First form: in the first ten minutes (or the first half of a shorter run) the robots run at 2 · X times real
time and fill the histories for playback and export. This phase lasts until the recording of every robot is
full. After the M minutes one client reloads its page N times. The memory of the server and of its children
may then have grown by at most 5 % since the histories were full, the numbers of threads and handles must be
the same as before, and 100 reloads may cost at most 5 MB. The measured memory is the memory that a process
has written and does not share with other processes. Free memory is returned to the system first. Otherwise
the memory that an allocator keeps would vary by more than a leak adds. The pages of libraries are not
counted: their memory also varies, because they are shared only as long as another program uses them.

With --every, each learner opens another scene, starts a ghost or ends it every S seconds, at random, after
all have opened every scene once. The simulations run at X times real time, so that a small machine can run
all of them. The memory `rss` is measured without garbage collection before it. It may never be more than
BASE + K · EACH, and in the last third of the time at most 10 % more than in the first. (Thirds are compared
only if each is at least five minutes long, because shorter ones differ by the scenes that happen to be open.)
At the end all learners return to the first scene, and nothing may be left behind.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import gc
import json
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from pathlib import Path
from random import Random
from statistics import median

import psutil

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.messages import Load, Speed
from app.link.process import wait_until
from app.web.server import PageServer
from benchmarks.child import LONG
from benchmarks.client import Viewers
from benchmarks.learners import served, simulated
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import Ghost

SCENES = (
    "planar3-hold", "iiwa14-hold", "planar3-circle", "panda-hold", "ridgeback-ur10-drag", "baxter-hold",
    "iiwa14-htmpc", "ridgeback-ur10-hold",
)  # fmt: skip
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
SWITCHED, THIRD = 1.1, 5.0
"""Factor by which memory may grow while scenes change, and the shortest third, minutes, that is compared."""
BASE, EACH = 300.0, 50.0
"""Memory of a server with its libraries and the meshes of all scenes, and of a learner with a ghost, MB."""


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
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--clients", type=int, default=8)
    parser.add_argument("--reconnects", type=int, default=100)
    parser.add_argument("--scene", default="iiwa14-hold")
    parser.add_argument("--every", type=float, help="seconds between two changes of a learner")
    parser.add_argument("--speed", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    first = options.scene if options.every is None else SCENES[0]
    with served(RunSpec(first), options.clients) as (server, viewers, learners):
        faults = (lasting if options.every is None else switching)(server, viewers, learners, options)
    print(json.dumps({"faults": faults}))
    return 1 if faults else 0


# ------------------------------------------------------------------ over time, and over reconnections


def lasting(
    _: PageServer, viewers: Viewers, learners: Sequence[SimulationClient], options: argparse.Namespace
) -> list[str]:
    """Returns sentences about exceeded limits."""
    fill = min(FILL, options.minutes / 2)
    go(learners, 2.0 * options.speed)
    watched(fill, viewers.pid)
    while not all(each.read(lambda recording: recording.full) for each in learners):
        time.sleep(EVERY)
    go(learners, 1.0)
    later = watched(options.minutes - fill, viewers.pid, fill)
    some = max(NEAR, len(later) // 10)  # data on the way to a client vary within minutes
    faults = grown(later[:some], later[-some:], ("server", "children"), GROWTH)
    faults += grown(later[:some], later[-some:], ("processes", "threads", "handles"), 1.0, SPARE)
    cost = reconnected(viewers, options.reconnects)
    print(json.dumps({"reconnects_mb_per_100": cost}))
    return faults + ([f"100 reconnects cost {cost:.1f} MB."] if cost > PER_100 else [])


def go(learners: Iterable[SimulationClient], speed: float) -> None:
    """Sets the speed of all robots, simulated seconds per second."""
    for learner in learners:
        learner.send(Speed(speed))


def grown(
    first: Sequence[Sample], last: Sequence[Sample], names: Iterable[str], factor: float, spare: float = 0.0
) -> list[str]:
    """Returns a sentence for each of these figures whose median grew by more than a factor and a number."""
    pairs = {name: [median(getattr(each, name) for each in part) for part in (first, last)] for name in names}
    return [
        f"There were {before:g} of {name}, then {after:g}."
        for name, (before, after) in pairs.items()
        if after > factor * before + spare
    ]


def reconnected(viewers: Viewers, times: int) -> float:
    """Returns the MB that the server keeps per hundred reloads of a page, after some reloads to warm up. This
    is the median slope between any two of several batches, because a single reading varies."""
    if not times:
        return 0.0
    size, held = max(1, times // BATCHES), list[float]()
    for count in (max(20, times // 5), *(BATCHES * [size])):
        came = viewers.reload(count)
        assert came == count, f"of {count} visits only {came} saw a robot"
        time.sleep(REST)
        held.append(median(sample(0.0, viewers.pid).server for _ in range(NEAR) if time.sleep(0.5) is None))
    pairs = combinations(range(len(held)), 2)
    return round(median(100 / size * (held[b] - held[a]) / (b - a) for a, b in pairs), 2)


def watched(
    minutes: float, client: int, after: float = 0.0, meanwhile: Callable[[], object] | None = None
) -> list[Sample]:
    """Returns samples over a number of minutes, or over a longer time if these are too few for a verdict.
    after: the minute of the first sample. meanwhile: what is done all the time; memory is then measured as
    it is, and is not tidied before."""
    began, found, due = time.monotonic(), list[Sample](), 0.0
    while (minute := (time.monotonic() - began) / 60) < minutes or len(found) < 2 * NEAR:
        if time.monotonic() >= due:
            due = time.monotonic() + min(EVERY, 60.0 * minutes / 20 if meanwhile else EVERY)
            found.append(sample(after + minute, client, tidied=meanwhile is None))
            if len(found) % 12 == 1:  # a run takes an hour and may fail at its end
                print(json.dumps(asdict(found[-1])), flush=True)
        (meanwhile or (lambda: time.sleep(EVERY)))()
    return found


def sample(minute: float, client: int, tidied: bool = True) -> Sample:
    """Returns what the server and its children use now. client: id of the process that is not part of the
    server. tidied: whether free memory is returned to the system first."""
    server = psutil.Process()
    if tidied:
        tidy()
    memory = written(server)
    own, processes = 0.0, 0
    for child in server.children(recursive=True):
        with contextlib.suppress(psutil.NoSuchProcess):
            if child.pid != client:
                own += written(child)
                processes += 1
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


# ------------------------------------------------------------------ while scenes change


def switching(
    server: PageServer, viewers: Viewers, learners: Sequence[SimulationClient], options: argparse.Namespace
) -> list[str]:
    """Returns sentences about exceeded limits."""
    for scene in (*SCENES, SCENES[0]):  # the meshes of each robot are loaded once
        everybody(learners, scene, options.speed)
    before, chance = state(server), Random(options.seed)
    print(json.dumps({"after the warm-up": before}), flush=True)

    def each_in_turn() -> None:
        for learner in learners:
            change(learner, chance, options.speed)
            time.sleep(options.every / len(learners))

    samples = watched(options.minutes, viewers.pid, meanwhile=each_in_turn)
    everybody(learners, SCENES[0], options.speed)
    after = state(server)
    print(json.dumps({"at the end": after}), flush=True)
    counted = ("processes", "blocks", "nodes", "controls")
    faults = [f"There were {before[x]:g} {x}, then {after[x]:g}." for x in counted if after[x] > before[x]]
    if options.minutes >= 3 * THIRD:
        third = len(samples) // 3
        faults += grown(samples[:third], samples[-third:], ("rss",), SWITCHED)
    peak, most = max(each.rss for each in samples), BASE + EACH * len(learners)
    if peak > most:
        faults.append(f"Memory reached {peak:.0f} MB; at most {most:.0f} were expected.")
    return faults


def change(learner: SimulationClient, chance: Random, speed: float) -> None:
    """Does one action of a learner."""
    match chance.choices(("scene", "ghost", "alone"), (5, 3, 2))[0]:
        case "scene":
            learner.load(SceneChoice(RunSpec(chance.choice(SCENES))))
        case "ghost":
            learner.start_ghost(Ghost("N = 1", ("horizon=1",)))
        case _:
            learner.stop_ghost()
    learner.send(Speed(speed))


def everybody(learners: Sequence[SimulationClient], scene: str, speed: float) -> None:
    """Moves all learners to a scene, without ghosts."""
    for learner in learners:
        learner.stop_ghost()
        learner.send(Load(SceneChoice(RunSpec(scene))))
        learner.send(Speed(speed))

    def shown() -> bool:
        return all(each.choice.run.scene == scene and simulated(each) > 0.01 for each in learners)

    assert wait_until(shown, LONG), f"not all show {scene}"


def state(server: PageServer) -> dict[str, float]:
    """Returns the state of the server after all pages were built and nothing was added to them any more."""
    viewers = server._viser.get_clients().values()

    def shown() -> dict[str, float]:
        nodes = [viewer.scene._handle_from_node_name for viewer in viewers]
        assert wait_until(lambda: all("/robot/1" in each for each in nodes), LONG), "not all pages are built"
        controls = sum(len(viewer.gui._gui_input_handle_from_uuid) for viewer in viewers)
        return {"nodes": sum(map(len, nodes)), "controls": controls}

    before: dict[str, float] = {}
    while before != (before := shown()):
        time.sleep(4.0)
    gc.collect()
    process = psutil.Process()
    return before | {
        "megabytes": round(1e-6 * process.memory_info().rss, 1),
        "processes": len(process.children(recursive=True)),
        "blocks": sum("memfd:himpc-lab" in each.path for each in process.memory_maps(grouped=False)),
    }


if __name__ == "__main__":
    sys.exit(main())
