"""Counts the periods of 1 ms that the loop of an arm misses on this machine, without a real-time kernel.

    python -m benchmarks.arm [--seconds 60]

The loop of `himpc-lab arm` holds the posture of the simulated panda in real time. It runs first without
real-time priority and then, if this machine allows it, with real-time priority (as under `chrt -f 50`).
"""

from __future__ import annotations

import argparse
import math
import os
import tempfile
from pathlib import Path

import numpy as np

from app.arm.guard import Tolerances
from app.arm.loop import Columns, run
from app.arm.orders import Orders
from app.arm.prepared import maker, prepared
from app.link.ring import Block
from himpc.export.native import build
from lessons.scenes.catalog import as_torque_scene
from lessons.scenes.run_spec import RunSpec
from robots import Plant
from robots.arms.arm import Reading
from robots.arms.simulated_arm import SimulatedArm

PATIENT = Tolerances(missed=10**9, missed_share=2.0, silent=math.inf)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0)
    seconds = parser.parse_args().seconds
    print("load average of the last minute:", os.getloadavg()[0])
    with tempfile.TemporaryDirectory() as folder:
        library = build(Path(folder))
        measure("without", library, seconds)
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50))
        except OSError as error:
            print(f"real-time priority is not allowed on this machine: {error}")
            return
        measure("with", library, seconds)


def measure(priority: str, library: Path, seconds: float) -> None:
    """Runs the loop, and prints the number of missed periods and the times of the controller."""
    scene = as_torque_scene(RunSpec("panda-hold").for_export().prepared(), "an arm")
    arm = SimulatedArm(Plant(scene.robot))
    ready = prepared(scene, scene.q_0, arm.limits, ())
    controller, orders = maker(library, ready.image)(), Orders(len(ready.image.manifest["tasks"]))
    at = Columns.of(controller.n, controller.view("error").size)
    block, rows = Block(at.width, controller.n + 1), []
    read = arm.read

    def counted() -> Reading:
        reading = read()
        rows.append(block.since(block.count - 1)[1][-1] if block.count else np.zeros(at.width))
        if reading.t > seconds:
            orders.stop()
        return reading

    arm.read = counted
    run(arm, controller, ready.limits, scene.q_0, orders, block, PATIENT, scene.settings.T_s)
    found = np.array(rows)
    missed, us = found[:, at.missed], found[:, at.us]
    print(
        f"{priority} real-time priority: {len(rows)} periods, {int(missed.sum())} missed in "
        f"{int((missed > 0).sum())} places, at most {int(missed.max())} in a row; controller median "
        f"{np.median(us):.0f} us, 99 % {np.percentile(us, 99):.0f} us, longest {us.max():.0f} us",
        flush=True,
    )


if __name__ == "__main__":
    main()
