"""Runs HIMPC with many active bounds: long horizons, low limits, dragged targets.

    python -m benchmarks.bounds [--quick] [--seconds 0.33] [--scenes NAME …] [--horizons N …]
                                [--velocity SCALE …] [--torque SCALE …] [--printed]

Every torque scene runs with every horizon and every scale of its velocity and torque limits, while all its
targets jump every 80 ms, without distances and without the guard of a blocked robot (`avoidance.on=false`,
`limits.stall_guard=false`). For each run the program prints a line of a Markdown table: the number of QPs
without a verified optimum, the largest joint velocity as a share of its limit, the processor time of the
longest and of the median step, and the largest share of its budget that a tick used. --quick runs only the
hardest cells; --printed also runs himpc_printed. The exit code is 1 if more than 1 % of the QPs of a
cell are unsolved, if a step takes more than 20 ms, or if a joint moves more than 2 % faster than its limit
and than with himpc_printed, where this was run.
"""

from __future__ import annotations

import gc
import sys
from itertools import product
from time import thread_time
from typing import NamedTuple

import numpy as np
import tyro

from benchmarks.avoidance import jumps
from lessons.scenes.names import SCENES
from lessons.scenes.run_spec import RunSpec
from lessons.scenes.scene import TorqueScene
from lessons.session.torque import TorqueSession

HORIZONS, VELOCITY, TORQUE = (1, 5, 10, 20, 30), (1.0, 0.3, 0.2, 0.1), (1.0, 0.5)
LONGEST_MS, MOST_UNSOLVED = 20.0, 0.01
_FIRST, _EVERY = 0.01, 0.08
"""s: the first jump of the targets, and the time between two jumps."""


class Cell(NamedTuple):
    """The settings of a row of the table."""

    scene: str
    N: int
    velocity: float
    torque: float


class Found(NamedTuple):
    """The results of one controller.

    Attributes:
        unsolved, of: QPs without a verified optimum, and all QPs.
        speed: the largest joint velocity as a share of its limit.
        longest_ms, median_ms: processor time of the longest and the median step, ms. The first step is not
            counted.
        spent: the largest share of its budget that a tick of the kernel used.
    """

    unsolved: int
    of: int
    speed: float
    longest_ms: float
    median_ms: float
    spent: float


QUICK = tuple(
    Cell(scene, N, 0.1, 1.0)
    for scene, N in (
        ("baxter-conflict", 30), ("baxter-conflict", 20), ("baxter-hold", 30), ("iiwa14-hold", 30),
        ("iiwa14-hold", 20), ("iiwa14-table", 30),
    )
)  # fmt: skip


def run(cell: Cell, controller: str, seconds: float) -> Found:
    """Returns the results of one cell with one controller."""
    without = ("avoidance.on=false", "limits.stall_guard=false")  # as in the scenes of the papers
    scaled = (f"limits.velocity_scale={cell.velocity}", f"limits.torque_scale={cell.torque}")
    given = (f"horizon={cell.N}", *scaled, *without)
    scene = RunSpec(cell.scene, controller=controller, set=given).prepared()
    assert isinstance(scene, TorqueScene)
    session, rng = TorqueSession(scene), np.random.default_rng(0)
    T_s = session.scene.settings.T_s
    first, every = round(_FIRST / T_s), max(round(_EVERY / T_s), 1)
    unsolved, of, speed, spent = 0, 0, 0.0, 0.0
    times: list[float] = []
    kernel = getattr(session.controller, "kernel", None)
    gc.collect()
    gc.freeze()  # garbage collection is not part of a tick
    for tick in range(round(seconds / T_s)):
        if tick % every == first % every:
            for event in jumps(session, rng):
                session.post(event)
        started = thread_time()
        session.tick()
        times.append(1e3 * (thread_time() - started))
        plan = session.plan
        assert plan is not None
        unsolved, of = unsolved + plan.unsolved, of + len(plan.levels)
        speed = max(speed, float(np.abs(session.plant.v / (cell.velocity * session.robot.v_limit)).max()))
        if kernel is not None:
            spent = max(spent, 1.0 - float(kernel.arena.f["budget"][0]) / kernel.budget)
        if session.diverged_at is not None:
            speed = np.inf
            break
    return Found(unsolved, of, speed, max(times[1:]), float(np.median(times[1:])), spent)


def main(
    quick: bool = False, seconds: float = 0.33, scenes: tuple[str, ...] = (), printed: bool = False,
    horizons: tuple[int, ...] = HORIZONS, velocity: tuple[float, ...] = VELOCITY,
    torque: tuple[float, ...] = TORQUE,
) -> int:  # fmt: skip
    """Does what the module says."""
    print("| scene | N | velocity | torque | unsolved | printed | speed | printed | ms | median | budget | |")
    print("|---|---|---|---|---|---|---|---|---|---|---|---|")
    ran = wrong = 0
    every = [
        Cell(scene, N, v_scale, tau_scale)
        for scene in scenes or [name for name in SCENES if name != "hold"]
        for N, v_scale, tau_scale in product(horizons, velocity, torque)
    ]
    for cell in QUICK if quick else every:
        found, other, said = run(cell, "himpc", seconds), ("", ""), list[str]()
        if found.longest_ms > LONGEST_MS:
            said.append("slow")
        if found.unsolved > MOST_UNSOLVED * found.of:
            said.append("unsolved")
        if printed:
            reference = run(cell, "himpc_printed", seconds)
            other = (str(reference.unsolved), f"{reference.speed:.3f}")
            if found.speed > 1.02 * max(reference.speed, 1.0):
                said.append("fast")
        ran, wrong = ran + 1, wrong + bool(said)
        print(
            f"| {cell.scene} | {cell.N} | {cell.velocity:g} | {cell.torque:g} "
            f"| {found.unsolved} of {found.of} | {other[0]} | {found.speed:.3f} | {other[1]} "
            f"| {found.longest_ms:.1f} | {found.median_ms:.1f} "
            f"| {100 * found.spent:.0f} % | {', '.join(said)} |",
            flush=True,
        )
    print(f"\n{ran} cells, {wrong} with faults")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(tyro.cli(main, description=__doc__))
