"""Measures the cost of a learner: the server's share of a core, bytes, the memory of its simulation, and its
frame rates.

    python -m benchmarks.learners [--clients K] [--scene S] [--horizon N] [--tab TAB] [--seconds S] [--json -]

The program starts the real server and, in a process of their own, K clients that use the page's protocol and
draw nothing (benchmarks/client.py). Each client has the plots of one tab visible. The exit code is 0 if every
learner costs the server at most 8 % of a core and 300 kB/s and receives poses at 30 Hz and plots at 10 Hz.
Poses at 27 Hz are accepted, as packets arrive in groups. The real-time factor of the simulations depends on
the machine's cores; it is not judged.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import threading
import time
from statistics import median
from typing import Any

import psutil

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.process import wait_until
from app.web.server import PageServer
from benchmarks.client import PATIENCE
from lessons.scenes.run_spec import RunSpec

SETTLE = 5.0  # s
LONG = 180.0  # s
SHARE, KILOBYTES, POSES_HZ, PLOTS_HZ = 0.08, 300.0, 27.0, 10.0


def main() -> int:
    """Measures as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--clients", type=int, default=2)
    parser.add_argument("--scene", default="iiwa14-circle")
    parser.add_argument("--horizon", type=int, default=None)
    parser.add_argument("--tab", default="Joints")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--json", choices=["-"], default=None)
    options = parser.parse_args()
    own = () if options.horizon is None else (f"horizon={options.horizon}",)
    server = PageServer(SceneChoice(RunSpec(options.scene, set=own)), port=0, max_sessions=options.clients)
    try:
        found = measured(server, options.clients, options.tab, options.seconds)
    finally:
        server.close()
    found = {"scene": options.scene, "tab": options.tab, "cores": psutil.cpu_count(), **found}
    print(json.dumps(found, indent=1) if options.json else table(found))
    return 0 if holds(found) else 1


class Viewers:
    """Clients in a process of their own. said: the lines that they have printed."""

    def __init__(self, url: str, *arguments: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.client", url, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.pid = self._process.pid
        self.said: list[dict[str, Any]] = []
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.said.append(json.loads(line))

    def reload(self, times: int) -> int:
        """Lets the first client reload its page. Returns how often it saw its robot."""
        assert self._process.stdin is not None
        heard = len(self.said)
        self._process.stdin.write(f"{times}\n")
        self._process.stdin.flush()
        assert wait_until(lambda: bool(_came(self.said[heard:])), LONG + PATIENCE * times, 0.1), "no answer"
        return _came(self.said[heard:])[0]

    def __enter__(self) -> Viewers:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()


def _came(said: list[dict[str, Any]]) -> list[int]:
    return [line["came"] for line in said if "came" in line]


def measured(server: PageServer, clients: int, tab: str, seconds: float) -> dict[str, Any]:
    """Returns the server's load and bytes per learner, and the figures of each learner."""
    with Viewers(server.link, "--clients", str(clients), "--tab", tab) as viewers:
        assert wait_until(lambda: len(server.sessions.learners) == clients, LONG), "not all were admitted"
        learners = server.sessions.learners
        assert wait_until(lambda: all(simulated(each) > 0.5 for each in learners), LONG), "nothing runs"
        time.sleep(SETTLE)
        heard = len(viewers.said)
        before = [(simulated(each), *counts(each)) for each in learners]
        busy, began = time.process_time(), time.perf_counter()
        time.sleep(seconds)
        spent = time.perf_counter() - began
        share = (time.process_time() - busy) / spent / clients
        each = [found(*both, spent) for both in zip(learners, before, strict=True)]
        got = [of_client(viewers.said[heard:], client) for client in range(clients)]
    rows = [{**one, **other} for one, other in zip(each, got, strict=True)]
    return {
        "clients": clients,
        "server_share_per_learner": round(share, 4),
        "kilobytes_per_s": median(row["kilobytes_per_s"] for row in rows),
        "learners": rows,
    }


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
    rates = {name: median(line[name] for line in own) for name in ("megabytes_per_s", "plots_hz", "poses_hz")}
    return {
        "kilobytes_per_s": round(1e3 * rates["megabytes_per_s"], 1),
        "plots_hz": round(rates["plots_hz"], 1),
        "poses_hz": round(rates["poses_hz"], 1),
    }


def simulated(learner: SimulationClient) -> float:
    """Returns the simulated time, s, from the memory that is shared with the simulation."""
    found = learner.read(lambda block, _: block.moment()[0])
    return 0.0 if found is None else found


def counts(learner: SimulationClient) -> tuple[int, int]:
    """Returns (control ticks, ticks over budget) of the last report."""
    status = learner.status
    return (0, 0) if status is None else (status.ticks, status.over_budget)


def holds(found: dict[str, Any]) -> bool:
    """Returns whether every figure is within its limit."""
    return found["server_share_per_learner"] <= SHARE and all(
        row["kilobytes_per_s"] <= KILOBYTES and row["poses_hz"] >= POSES_HZ and row["plots_hz"] >= PLOTS_HZ
        for row in found["learners"]
    )


def table(found: dict[str, Any]) -> str:
    """Returns the results as a table."""
    head = (
        f"{found['scene']}, {found['clients']} learners, tab {found['tab']}, {found['cores']} cores\n"
        f"server: {found['server_share_per_learner']:.1%} of a core per learner (at most {SHARE:.0%})\n"
    )
    names = list(found["learners"][0])
    rows = [[str(row[name]) for name in names] for row in found["learners"]]
    widths = [max(len(cell) for cell in column) for column in zip(names, *rows, strict=True)]
    lines = ["  ".join(cell.rjust(w) for cell, w in zip(row, widths, strict=True)) for row in [names, *rows]]
    return head + "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
