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

import argparse
import gc
import sys
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from itertools import product
from time import thread_time
from typing import NamedTuple

import numpy as np

from himpc.rotation import exp3, quaternion
from lessons.events import MoveTarget
from lessons.scenes.catalog import torque_scene
from lessons.scenes.names import SCENES
from lessons.session.torque import TorqueSession
from robots.errors import InputError

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


QUICK = (
    Cell("baxter-conflict", 30, 0.1, 1.0),
    Cell("baxter-conflict", 20, 0.1, 1.0),
    Cell("baxter-hold", 30, 0.1, 1.0),
    Cell("iiwa14-hold", 30, 0.1, 1.0),
    Cell("iiwa14-hold", 20, 0.1, 1.0),
    Cell("iiwa14-table", 30, 0.1, 1.0),
)


def session_of(cell: Cell, controller: str) -> TorqueSession:
    """Returns a session with the settings of a cell."""
    scene = torque_scene(cell.scene)
    # Without distances and without the guard of a blocked robot, as in the scenes of the papers.
    limits = replace(
        scene.settings.limits,
        velocity_scale=cell.velocity,
        torque_scale=cell.torque,
        stall_guard=False,
        avoidance=replace(scene.settings.limits.avoidance, on=False),
    )
    settings = replace(scene.settings, horizon=cell.N, controller=controller, limits=limits)
    return TorqueSession(replace(scene, settings=settings))


def drag(session: TorqueSession, rng: np.random.Generator) -> None:
    """Moves every target that can be moved by a normal sample: positions by 0.3 m and postures by 0.3 rad per
    component, orientations by 0.6 rad per axis."""
    for level in session.scene.settings.levels:
        for task in level.tasks:
            target = session.target(task.name)
            if target is None:
                continue
            raw = target.raw
            if raw.ndim == 2:
                value = quaternion(exp3(0.6 * rng.normal(size=3)) @ raw)
            else:
                value = raw + 0.3 * rng.normal(size=raw.shape)
            with suppress(InputError):  # a target outside the range of the task
                session.post(MoveTarget(task.name, tuple(value.tolist())))


def run(cell: Cell, controller: str, seconds: float) -> Found:
    """Returns the results of one cell with one controller."""
    session, rng = session_of(cell, controller), np.random.default_rng(0)
    T_s = session.scene.settings.T_s
    first, every = round(_FIRST / T_s), max(round(_EVERY / T_s), 1)
    unsolved, of, speed, spent = 0, 0, 0.0, 0.0
    times: list[float] = []
    kernel = getattr(session.controller, "kernel", None)
    gc.collect()
    gc.freeze()  # garbage collection is not part of a tick
    for tick in range(round(seconds / T_s)):
        if tick % every == first % every:
            drag(session, rng)
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


def cells(given: argparse.Namespace) -> Iterable[Cell]:
    """Returns the cells that the command line selects."""
    if given.quick:
        return QUICK
    scenes: Iterable[str] = given.scenes or [name for name in SCENES if name != "hold"]
    return [
        Cell(scene, N, velocity, torque)
        for scene in scenes
        for N, velocity, torque in product(given.horizons, given.velocity, given.torque)
    ]


def faults(found: Found, reference: Found | None) -> list[str]:
    """Returns a word for each limit that HIMPC exceeded."""
    said = ["slow"] if found.longest_ms > LONGEST_MS else []
    said += ["unsolved"] if found.unsolved > MOST_UNSOLVED * found.of else []
    if reference is not None:
        said += ["fast"] if found.speed > 1.02 * max(reference.speed, 1.0) else []
    return said


def main() -> int:
    """Prints the table and the number of cells with faults."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--seconds", type=float, default=0.33)
    parser.add_argument("--scenes", nargs="+")
    parser.add_argument("--horizons", nargs="+", type=int, default=HORIZONS)
    parser.add_argument("--velocity", nargs="+", type=float, default=VELOCITY)
    parser.add_argument("--torque", nargs="+", type=float, default=TORQUE)
    parser.add_argument("--printed", action="store_true", help="also runs himpc_printed")
    given = parser.parse_args()
    print("| scene | N | velocity | torque | unsolved | printed | speed | printed | ms | median | budget | |")
    print("|---|---|---|---|---|---|---|---|---|---|---|---|")
    ran = wrong = 0
    for cell in cells(given):
        found = run(cell, "himpc", given.seconds)
        reference = run(cell, "himpc_printed", given.seconds) if given.printed else None
        said = faults(found, reference)
        ran, wrong = ran + 1, wrong + bool(said)
        other = ("", "") if reference is None else (str(reference.unsolved), f"{reference.speed:.3f}")
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
    sys.exit(main())
