"""Measures the computing time of the parts of a control tick: reference, control step, telemetry, plant.

    python benchmarks/tick.py [SCENE] [TICKS]

The program prints JSON: medians and 99th percentiles in microseconds, and the simulated seconds per second of
real time.
"""

from __future__ import annotations

import json
import sys
from time import perf_counter_ns

import numpy as np

from himpc.plan import write_plan
from himpc.references import Outlook
from lessons.scenes.catalog import torque_scene
from lessons.session.torque import TorqueSession


def measure(scene: str, ticks: int) -> dict[str, dict[str, float] | float]:
    """Runs a scene, and times the parts of every tick separately, on the same states as the whole tick."""
    session = TorqueSession(torque_scene(scene))
    T_s, N = session.settings.T_s, session.settings.horizon
    spent: dict[str, list[int]] = {"tick": [], "reference": [], "control step": [], "telemetry": []}
    row = np.empty(session.layout.size)
    for _ in range(ticks):
        started = perf_counter_ns()
        for reference in session.references.values():
            reference.preview(session.t, T_s, N)
        read = perf_counter_ns()
        session.tick()
        done = perf_counter_ns()
        plan = session.plan
        assert plan is not None
        write_plan(row, session.layout, plan, Outlook(session.references, session.t, T_s, N))
        spent["reference"].append(read - started)
        spent["tick"].append(done - read)
        spent["telemetry"].append(perf_counter_ns() - done)
        spent["control step"].append(int(1e3 * plan.step_us))
    result: dict[str, dict[str, float] | float] = {
        part: {"median_us": float(np.median(times)) / 1e3, "p99_us": float(np.percentile(times, 99)) / 1e3}
        for part, times in spent.items()
    }
    result["real_time_factor"] = T_s * 1e9 / float(np.mean(spent["tick"]))
    return result


if __name__ == "__main__":
    name = sys.argv[1] if len(sys.argv) > 1 else "iiwa14-circle"
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 3000
    print(json.dumps({"scene": name, "ticks": count, **measure(name, count)}, indent=1))
