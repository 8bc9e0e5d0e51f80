"""Measures the cost of a learner: the server's share of a core, bytes, the memory of its simulation, and its
frame rates.

    python -m benchmarks.learners [--clients K] [--scene S] [--horizon N] [--tab TAB] [--seconds S]

The program starts the real server and, in a process of their own, K clients that use the page's protocol and
draw nothing (benchmarks/client.py). Each client has the plots of one tab visible. It prints JSON. The exit
code is 0 if every learner costs the server at most 8 % of a core and 300 kB/s and receives poses at 30 Hz and
plots at 10 Hz. Poses at 27 Hz are accepted, as packets arrive in groups. The real-time factor of the
simulations depends on the machine's cores; it is not judged.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from statistics import median
from typing import Any

import psutil
import tyro

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.process import wait_until
from app.web.server import PageServer, ServerOptions
from benchmarks.child import LONG
from benchmarks.client import Viewers
from browsing.viewer import CURVES
from lessons.scenes.run_spec import RunSpec

SETTLE = 5.0  # s
SHARE, KILOBYTES, POSES_HZ, PLOTS_HZ = 0.08, 300.0, 27.0, 10.0
RATES = {
    "kilobytes_per_s": ("megabytes_per_s", 1e3),
    "plots_hz": ("plots_hz", 1),
    "poses_hz": ("poses_hz", 1),
}


def main(
    clients: int = 2, scene: str = "iiwa14-circle", horizon: int | None = None, tab: str = CURVES,
    seconds: float = 20.0,
) -> int:  # fmt: skip
    """Does what the module says."""
    own = () if horizon is None else (f"horizon={horizon}",)
    with served(RunSpec(scene, set=own), clients, "--tab", tab) as (_, viewers, learners):
        time.sleep(SETTLE)
        heard = len(viewers.said)
        before = [(simulated(each), *counts(each)) for each in learners]
        busy, began = time.process_time(), time.perf_counter()
        time.sleep(seconds)
        spent = time.perf_counter() - began
        share = (time.process_time() - busy) / spent / clients
        rows = [
            {**found(*both, spent), **of_client(viewers.said[heard:], client)}
            for client, both in enumerate(zip(learners, before, strict=True))
        ]
    told = {
        "clients": clients,
        "scene": scene,
        "horizon": horizon,
        "tab": tab,
        "cores": psutil.cpu_count(),
    }
    print(json.dumps({**told, "server_share_per_learner": round(share, 4), "learners": rows}, indent=1))
    good = share <= SHARE and all(
        row["kilobytes_per_s"] <= KILOBYTES and row["poses_hz"] >= POSES_HZ and row["plots_hz"] >= PLOTS_HZ
        for row in rows
    )
    return 0 if good else 1


@contextmanager
def served(
    run: RunSpec, clients: int, *options: str
) -> Iterator[tuple[PageServer, Viewers, Sequence[SimulationClient]]]:
    """Yields a server, its clients and its learners, as soon as all their robots have moved for 0.5 s."""
    server = PageServer(SceneChoice(run), ServerOptions(port=0, max_sessions=clients))
    try:
        with Viewers(server.link, clients, *options) as viewers:
            assert wait_until(lambda: len(server.sessions.learners) == clients, LONG), "not all were admitted"
            learners = server.sessions.learners
            assert wait_until(lambda: all(simulated(each) > 0.5 for each in learners), LONG), "nothing runs"
            yield server, viewers, learners
    finally:
        server.close()


def found(learner: SimulationClient, before: tuple[float, int, int], seconds: float) -> dict[str, float]:
    """Returns the speed and the memory of a simulation. uss: the bytes that it shares with no other
    process."""
    ticks, over = (now - then for now, then in zip(counts(learner), before[1:], strict=True))
    own = psutil.Process(learner.pid).memory_full_info().uss
    return {
        "real_time_factor": round((simulated(learner) - before[0]) / seconds, 3),
        "over_budget": round(over / max(ticks, 1), 4),
        "child_uss_mb": round(1e-6 * own, 1),
    }


def of_client(said: list[dict[str, Any]], client: int) -> dict[str, float]:
    """Returns medians over the seconds of a client. Learners and clients are not matched, because all are in
    the same scene."""
    own = [line for line in said if line["client"] == client]
    return {name: round(scale * median(x[key] for x in own), 1) for name, (key, scale) in RATES.items()}


def simulated(learner: SimulationClient) -> float:
    """Returns the simulated time, s, from the memory that is shared with the simulation."""
    found = learner.read(lambda recording: recording.block.moment()[0])
    return 0.0 if found is None else found


def counts(learner: SimulationClient) -> tuple[int, int]:
    """Returns (control ticks, ticks over budget) of the last report."""
    status = learner.status
    return (0, 0) if status is None else (status.ticks, status.over_budget)


if __name__ == "__main__":
    sys.exit(tyro.cli(main, description=__doc__))
