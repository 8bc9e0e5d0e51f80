"""Measures two robots on one page: whether the simulation keeps up with real time, and how often the plots
are updated.

    python -m benchmarks.ghost [--scene S] [--set PATH=VALUE]… [--seconds S] [--alone]

The program starts the real server and, in a process of its own, a client that uses the page's protocol and
draws nothing (benchmarks/client.py). It then starts a ghost, waits until everything runs, and measures. It
prints JSON. The exit code is 0 if the simulation lost less than 1 % of real time and the plots were updated
at least 10 times per second.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import threading
import time

import numpy as np
import psutil

from app.client.simulation import Simulation
from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.process import wait_until
from app.web.server import PageServer
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import Ghost

SETTLE = 5.0  # s
LONG = 120.0  # s
HOLDS, PLOTS_HZ = 0.99, 10.0
"""Smallest real-time factor and plot rate. The factor is the ratio of two clocks that are read a moment
apart, so that a stricter limit would judge noise."""


def main() -> int:
    """Measures as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="iiwa14-circle")
    parser.add_argument("--set", action="append", default=[], metavar="PATH=VALUE", help="a ghost's setting")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--alone", action="store_true", help="runs without a ghost, for comparison")
    options = parser.parse_args()
    own = () if options.alone else tuple(options.set or ["controller=tdeosf"])
    server = PageServer(SceneChoice(RunSpec(options.scene)), port=0, max_sessions=1)
    try:
        result = measure(server, own, options.seconds)
    finally:
        server.close()
    result = {"scene": options.scene, "ghost": list(own), "cores": psutil.cpu_count(), **result}
    print(json.dumps(result, indent=1))
    return 0 if result["real_time_factor"] >= HOLDS and result["plots_hz"] >= PLOTS_HZ else 1


def measure(server: PageServer, own: tuple[str, ...], seconds: float) -> dict[str, float]:
    """Returns the ratio of simulated to real time while a client watches, the data that the client received,
    and the load of each process."""
    client = subprocess.Popen(
        [sys.executable, "-m", "benchmarks.client", server.link],
        stdout=subprocess.PIPE,
        text=True,
    )
    lines: list[str] = []
    assert client.stdout is not None
    threading.Thread(target=lines.extend, args=(client.stdout,), daemon=True).start()
    try:
        assert wait_until(lambda: bool(server.sessions.learners), LONG), "the client was not admitted"
        learner = server.sessions.learners[0]
        assert wait_until(lambda: simulated(learner) > 0.5, LONG), "nothing runs"
        if own:
            learner.start_ghost(Ghost(", ".join(own), own))
            assert wait_until(lambda: follows(learner), LONG), "the ghost does not follow"
        time.sleep(SETTLE)
        return measured(learner, lines, seconds)
    finally:
        client.kill()
        client.wait()


def measured(learner: SimulationClient, lines: list[str], seconds: float) -> dict[str, float]:
    """Returns the measured figures of a ghost. lines: the output of the client, one per second."""
    busy = {name: psutil.Process(pid) for name, pid in pids(learner).items()}
    for process in busy.values():
        process.cpu_percent()
    seen = len(lines)
    t, began = simulated(learner), time.perf_counter()
    behind = [0.0]
    while time.perf_counter() - began < seconds:
        time.sleep(0.1)
        if learner.ghost is not None:
            behind.append(simulated(learner) - simulated(learner.ghost))
    factor = (simulated(learner) - t) / (time.perf_counter() - began)
    cores = {f"{name}_cores": process.cpu_percent() / 100 for name, process in busy.items()}
    received = [json.loads(line) for line in lines[seen:]]
    means = {name: float(np.mean([each[name] for each in received])) for name in received[0]}
    status = learner.status
    found = {
        "real_time_factor": factor,
        **means,
        "ghost_behind_ms_mean": 1e3 * sum(behind) / len(behind),
        "ghost_behind_ms_max": 1e3 * max(behind),
        "slowed_down_at_the_end": float(status is not None and status.capped),
        **cores,
    }
    return {name: round(value, 3) for name, value in found.items()}


def simulated(learner: Simulation) -> float:
    """Returns the simulated time, s, from the memory that is shared with the simulation."""
    found = learner.read(lambda block, _: block.moment()[0])
    return 0.0 if found is None else found


def follows(learner: SimulationClient) -> bool:
    """Returns whether the ghost has kept up for a while."""
    ghost = learner.ghost
    return ghost is not None and simulated(ghost) > 1.0


def pids(learner: SimulationClient) -> dict[str, int]:
    """Returns the ids of the processes that are running."""
    found = {"page": psutil.Process().pid, "robot": learner.pid}
    if learner.ghost is not None:
        found["ghost"] = learner.ghost.pid
    return {name: pid for name, pid in found.items() if pid is not None}


if __name__ == "__main__":
    sys.exit(main())
