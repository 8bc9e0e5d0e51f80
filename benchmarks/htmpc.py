"""Measures the time of a step of HTMPC, alternately in this checkout and in another one.

    python benchmarks/htmpc.py [SCENE…] [--before CHECKOUT] [--runs R]

Each checkout has a process of its own that runs the scene. The processes run in turns of one second of
simulated time, so that both are disturbed equally. Processor time is measured, so that other programs do not
count. The program prints JSON: the median and the 99th percentile of the time from state to motion command,
and their ratios.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

SCENES = ("ridgeback-ur10-square", "ridgeback-ur10-cluttered")
HERE = Path(__file__).parents[1]
TURN = 10
"""The number of control steps of a turn."""
PLACES = (
    ("lessons.session.velocity", "VelocitySession", "lessons.scenes.missions", "velocity_scene"),
    ("lessons.mobile.session", "MobileSession", "lessons.scenes.mobile", "mobile_scene"),
)
"""The modules and names of the session and of its scenes, in this checkout and in older ones."""


def child(scene: str) -> None:
    """Runs some steps of a scene for every line on stdin, and prints their times, µs."""
    time.perf_counter_ns = time.thread_time_ns
    for session, kind, scenes, scene_of in PLACES:
        try:
            make, load = getattr(import_module(session), kind), getattr(import_module(scenes), scene_of)
            break
        except ModuleNotFoundError:
            continue
    else:
        raise SystemExit("this checkout has no velocity scenes")
    running = make(load(scene))
    for _ in range(5):
        running.tick()
    running.reset()
    for line in sys.stdin:
        times = []
        for _ in range(int(line)):
            running.tick()
            times.append(running.plan.step_us)
        print(json.dumps(times), flush=True)


def measure(scene: str, checkouts: dict[str, Path], seconds: float) -> dict[str, list[float]]:
    """Returns the step times of every checkout, µs."""
    started = {}
    for name, place in checkouts.items():
        environment = os.environ | {"PYTHONPATH": str(place), "OPENBLAS_NUM_THREADS": "1"}
        command = [sys.executable, __file__, "--child", scene]
        pipe = subprocess.PIPE
        started[name] = subprocess.Popen(
            command, env=environment, cwd=place, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True
        )
    times: dict[str, list[float]] = {name: [] for name in checkouts}
    for _ in range(round(10 * seconds / TURN)):
        for name, process in started.items():
            assert process.stdin is not None
            assert process.stdout is not None
            process.stdin.write(f"{TURN}\n")
            process.stdin.flush()
            times[name] += json.loads(process.stdout.readline())
    for process in started.values():
        process.communicate()
    return times


def main() -> None:
    """Measures as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=SCENES)
    parser.add_argument("--before", type=Path, help="another checkout of the project")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--child", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        child(options.child)
        return
    checkouts = {"here": HERE} | ({"before": options.before.resolve()} if options.before else {})
    found: dict[str, Any] = {}
    for scene in options.scenes:
        seconds = 16.0 if scene.endswith("square") else 30.0
        runs = [measure(scene, checkouts, seconds) for _ in range(options.runs)]
        spreads = [{name: spread(times) for name, times in run.items()} for run in runs]
        found[scene] = {
            name: {key: float(np.median([run[name][key] for run in spreads])) for key in ("median", "p99")}
            for name in checkouts
        }
        if options.before:
            found[scene]["ratio"] = {
                key: float(np.median([run["here"][key] / run["before"][key] for run in spreads]))
                for key in ("median", "p99")
            }
    print(json.dumps(found, indent=1))


def spread(times: list[float]) -> dict[str, float]:
    """Returns the median and the 99th percentile, µs."""
    return {"median": float(np.median(times)), "p99": float(np.percentile(times, 99))}


if __name__ == "__main__":
    main()
