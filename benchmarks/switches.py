"""Measures whether the server's memory stays constant while learners change scenes, with and without ghosts.

    python -m benchmarks.switches [--clients K] [--minutes M] [--every S] [--speed X] [--seed N]

The program starts the real server and, in a process of their own, K clients that draw nothing
(benchmarks/client.py). Every S seconds each learner opens another scene, starts a ghost or ends it, at
random. The simulations run at X times real time, so that a small machine can run all of them. Memory is
measured every five seconds, without garbage collection before it. A line of JSON is printed for every five
minutes (in a shorter run for every sixth part): the median and the maximum of the server's memory in that
time, MB. At the end all learners return to the first scene, and the server's memory is compared with its
memory after the warm-up.

The exit code is 0 if memory was never more than BASE + K · EACH, nothing was left behind, and memory in the
last third of the time was at most 10 % more than in the first. Thirds are compared only if each is at least
five minutes long, because shorter ones differ by the scenes that happen to be open.
"""

from __future__ import annotations

import argparse
import gc
import json
import random
import sys
import time
from dataclasses import dataclass, field
from statistics import median

import psutil

from app.client.simulation import Simulation
from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.messages import Load, Speed
from app.link.process import wait_until
from app.web.server import PageServer
from benchmarks.learners import Viewers
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import Ghost

SCENES = (
    "planar3-hold",
    "iiwa14-hold",
    "planar3-circle",
    "panda-hold",
    "ridgeback-ur10-drag",
    "baxter-hold",
    "iiwa14-htmpc",
    "ridgeback-ur10-hold",
)
LONG = 120.0  # s
PERIOD = 5.0  # minutes
LOOK = 5.0  # s
GROWTH = 1.1
BASE, EACH = 300.0, 50.0
"""Memory of a server with its libraries and the meshes of all scenes, and of a learner with a ghost, MB."""


@dataclass
class Period:
    """Samples of the memory, MB, from the minute `began` on."""

    began: float
    megabytes: list[float] = field(default_factory=list)

    def told(self) -> dict[str, float]:
        """Returns the period as a line for the terminal."""
        return {"minute": round(self.began, 1), "median": median(self.megabytes), "most": max(self.megabytes)}


def main() -> int:
    """Measures as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--clients", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--every", type=float, default=5.0)
    parser.add_argument("--speed", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    count = options.clients
    server = PageServer(SceneChoice(RunSpec(SCENES[0])), port=0, max_sessions=count)
    try:
        with Viewers(server.link, "--clients", str(count)):
            assert wait_until(lambda: len(server.sessions.learners) == count, LONG), "not all were admitted"
            learners = server.sessions.learners
            for learner in learners:
                learner.send(Speed(options.speed))
            assert wait_until(lambda: all(map(runs, learners)), LONG), "nothing runs"
            for scene in (*SCENES, SCENES[0]):  # the meshes of each robot are loaded once
                everybody(learners, scene, options.speed)
            before = state(server)
            print(json.dumps({"after the warm-up": before}), flush=True)
            periods = list(switched(learners, options))
            everybody(learners, SCENES[0], options.speed)
            after = state(server)
    finally:
        server.close()
    faults = judged(periods, before, after, BASE + EACH * count)
    print(json.dumps({"at the end": after, "faults": faults}), flush=True)
    return 1 if faults else 0


def switched(learners: tuple[SimulationClient, ...], options: argparse.Namespace) -> list[Period]:
    """Lets each learner in turn do an action, at fixed intervals."""
    chance, length = random.Random(options.seed), min(PERIOD, options.minutes / 6)
    periods = [Period(0.0)]
    began = looked = time.monotonic()
    while (minute := (time.monotonic() - began) / 60) < options.minutes:
        for learner in learners:
            change(learner, chance, options.speed)
            time.sleep(options.every / len(learners))
            if time.monotonic() - looked > min(LOOK, 10 * length):
                looked = time.monotonic()
                periods[-1].megabytes.append(megabytes())
        if minute - periods[-1].began >= length and periods[-1].megabytes:
            print(json.dumps(periods[-1].told()), flush=True)
            periods.append(Period(minute))
    return [period for period in periods if period.megabytes]


def change(learner: SimulationClient, chance: random.Random, speed: float) -> None:
    """Does one action of a learner."""
    match chance.choices(("scene", "ghost", "alone"), (5, 3, 2))[0]:
        case "scene":
            learner.load(SceneChoice(RunSpec(chance.choice(SCENES))))
        case "ghost":
            learner.start_ghost(Ghost("N = 1", ("horizon=1",)))
        case _:
            learner.stop_ghost()
    learner.send(Speed(speed))


def everybody(learners: tuple[SimulationClient, ...], scene: str, speed: float) -> None:
    """Moves all learners to a scene, without ghosts."""
    for learner in learners:
        learner.stop_ghost()
        learner.send(Load(SceneChoice(RunSpec(scene))))
        learner.send(Speed(speed))
    assert wait_until(lambda: all(shows(each, scene) for each in learners), LONG), f"not all show {scene}"


def shows(learner: SimulationClient, scene: str) -> bool:
    """Returns whether a scene is running."""
    return learner.choice.run.scene == scene and runs(learner)


def runs(learner: Simulation) -> bool:
    """Returns whether the scene has run some ticks."""
    found = learner.read(lambda block, _: block.moment()[0])
    return found is not None and found > 0.01


def megabytes() -> float:
    """Returns the MB of the server, without any garbage collection before the measurement."""
    return round(1e-6 * psutil.Process().memory_info().rss, 1)


def state(server: PageServer) -> dict[str, float]:
    """Returns the state of the server after all pages were built and a moment passed without activity."""
    viewers = server._viser.get_clients().values()
    assert wait_until(
        lambda: all("/robot/1" in viewer.scene._handle_from_node_name for viewer in viewers), LONG
    ), "not all pages are built"
    time.sleep(4.0)
    gc.collect()
    process = psutil.Process()
    return {
        "megabytes": megabytes(),
        "processes": len(process.children(recursive=True)),
        "blocks": sum("memfd:himpc-lab" in each.path for each in process.memory_maps(grouped=False)),
        "nodes": sum(len(viewer.scene._handle_from_node_name) for viewer in viewers),
        "controls": sum(len(viewer.gui._gui_input_handle_from_uuid) for viewer in viewers),
    }


def judged(
    periods: list[Period], before: dict[str, float], after: dict[str, float], most: float
) -> list[str]:
    """Returns sentences about exceeded limits."""
    faults = [
        f"There were {before[name]:g} {name}, then {after[name]:g}."
        for name in ("processes", "blocks", "nodes", "controls")
        if after[name] > before[name]
    ]
    third = max(1, len(periods) // 3)
    parts = (periods[:third], periods[-third:])
    first, last = (median(each for period in part for each in period.megabytes) for part in parts)
    if last > GROWTH * first and periods[-1].began >= 2.0 * PERIOD:
        faults.append(f"Memory grew from {first:.0f} to {last:.0f} MB.")
    peak = max(max(period.megabytes) for period in periods)
    if peak > most:
        faults.append(f"Memory reached {peak:.0f} MB; at most {most:.0f} were expected.")
    return faults


if __name__ == "__main__":
    sys.exit(main())
