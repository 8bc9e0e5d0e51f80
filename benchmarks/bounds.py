"""Runs the compiled and the explicit route with many active bounds: long horizons, low limits, dragged
targets.

    python -m benchmarks.bounds [--quick] [--seconds 0.3] [--scenes NAME …] [--horizons N …]
                                [--velocity SCALE …] [--torque SCALE …] [--still | --dragged] [--alone]

Every torque scene runs with every horizon and every scale of its velocity and torque limits: once unchanged
and, if it has a target, once with a target that jumps every 50 ms. For each run the program prints a line of
a Markdown table: the number of QPs without a verified optimum, the largest joint velocity as a share of its
limit, the processor time of the longest step, and the largest share of its budget that a tick of the compiled
route used. --quick runs only the few hardest cases; --alone leaves out the explicit route. The exit code is 1
if the compiled route leaves a larger share of QPs unsolved than the explicit route, if it moves a joint more
than 2 % faster than the joint's limit and than the explicit route does, or if a step takes more than 20 ms.
"""

from __future__ import annotations

import argparse
import gc
import sys
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import product
from time import thread_time
from typing import NamedTuple

import numpy as np

from himpc.catalog import Route
from lessons.events import MoveTarget
from lessons.scenes.catalog import torque_scene
from lessons.scenes.names import SCENES
from lessons.session.torque import TorqueSession

HORIZONS, VELOCITY, TORQUE = (1, 5, 10, 20, 30), (1.0, 0.3, 0.2, 0.1), (1.0, 0.5)
LONGEST_MS = 20.0
_EVERY = 50
"""Ticks between two jumps of a dragged target."""


class Cell(NamedTuple):
    """The settings of a row of the table."""

    scene: str
    N: int
    velocity: float
    torque: float
    dragged: bool


class Found(NamedTuple):
    """The results of one route.

    Attributes:
        unsolved, of: QPs without a verified optimum, and all QPs.
        speed: the largest joint velocity as a share of its limit.
        longest_ms: processor time of the longest step, ms. The first step is not counted.
        spent: the largest share of its budget that a tick of the compiled route used.
    """

    unsolved: int
    of: int
    speed: float
    longest_ms: float
    spent: float


QUICK = (
    Cell("iiwa14-circle", 30, 0.3, 1.0, False),
    Cell("iiwa14-circle", 30, 0.2, 1.0, False),
    Cell("iiwa14-circle", 20, 0.1, 1.0, False),
    Cell("iiwa14-hold", 30, 0.3, 1.0, True),
    Cell("baxter-hold", 20, 0.3, 1.0, True),
)


def run(cell: Cell, route: Route, ticks: int) -> Found:
    """Returns the results of one cell with one route."""
    scene = torque_scene(cell.scene)
    limits = replace(scene.settings.limits, velocity_scale=cell.velocity, torque_scale=cell.torque)
    session = TorqueSession(
        replace(scene, settings=replace(scene.settings, horizon=cell.N, route=route, limits=limits))
    )
    rng, name = np.random.default_rng(1), target_of(session)
    home = None
    unsolved, of, speed, longest, spent = 0, 0, 0.0, 0.0, 0.0
    kernel = getattr(session.controller, "kernel", None)
    gc.collect()
    gc.freeze()  # garbage collection is not part of a tick
    for tick in range(ticks):
        target = session.target(name) if name and cell.dragged else None
        if name and target is not None and tick % _EVERY == 0:
            home = target.value if home is None else home
            session.post(MoveTarget(name, tuple((home + rng.uniform(-0.3, 0.3, home.size)).tolist())))
        started = thread_time()
        session.tick()
        if tick:
            longest = max(longest, 1e3 * (thread_time() - started))
        plan = session.plan
        assert plan is not None
        unsolved, of = unsolved + plan.unsolved, of + len(plan.levels)
        speed = max(speed, float(np.abs(session.plant.v / (cell.velocity * session.robot.v_limit)).max()))
        if kernel is not None:
            spent = max(spent, 1.0 - float(kernel.arena.f["budget"][0]) / kernel.budget)
        if session.diverged_at is not None:
            speed = np.inf
            break
    return Found(unsolved, of, speed, longest, spent)


def target_of(session: TorqueSession) -> str | None:
    """Returns the first position target that can be moved."""
    for name in session.references:
        target = session.target(name)
        if target is not None and target.raw.ndim == 1:
            return name
    return None


def cells(given: argparse.Namespace) -> Iterator[Cell]:
    """Returns the cells that the command line selects."""
    if given.quick:
        yield from QUICK
        return
    scenes: Iterable[str] = given.scenes or [name for name in SCENES if name != "hold"]
    for scene in scenes:
        draggable = target_of(TorqueSession(torque_scene(scene))) is not None
        for N, velocity, torque in product(given.horizons, given.velocity, given.torque):
            if not given.dragged:
                yield Cell(scene, N, velocity, torque, False)
            if draggable and not given.still:
                yield Cell(scene, N, velocity, torque, True)


def faults(found: Found, reference: Found | None) -> list[str]:
    """Returns a word for each limit that the compiled route exceeded."""
    said = ["slow"] if found.longest_ms > LONGEST_MS else []
    if reference is not None:
        said += ["unsolved"] if found.unsolved * reference.of > reference.unsolved * found.of else []
        said += ["fast"] if found.speed > 1.02 * max(reference.speed, 1.0) else []
    return said


def main() -> int:
    """Prints the table and the number of cells with faults."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--seconds", type=float, default=0.3)
    parser.add_argument("--scenes", nargs="+")
    parser.add_argument("--horizons", nargs="+", type=int, default=HORIZONS)
    parser.add_argument("--velocity", nargs="+", type=float, default=VELOCITY)
    parser.add_argument("--torque", nargs="+", type=float, default=TORQUE)
    parser.add_argument("--still", action="store_true", help="does only the runs without a dragged target")
    parser.add_argument("--dragged", action="store_true", help="does only the runs with a dragged target")
    parser.add_argument("--alone", action="store_true", help="leaves out the explicit route")
    given = parser.parse_args()
    print(
        "| scene | N | velocity | torque | dragged | unsolved | explicit | speed | explicit | ms | budget | |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|---|")
    ran = wrong = 0
    for cell in cells(given):
        ticks = round(given.seconds / torque_scene(cell.scene).settings.T_s)
        found = run(cell, "compiled", ticks)
        reference = None if given.alone else run(cell, "explicit", ticks)
        said = faults(found, reference)
        ran, wrong = ran + 1, wrong + bool(said)
        other = ("", "") if reference is None else (str(reference.unsolved), f"{reference.speed:.3f}")
        dragged = "yes" if cell.dragged else ""
        print(
            f"| {cell.scene} | {cell.N} | {cell.velocity:g} | {cell.torque:g} | {dragged} "
            f"| {found.unsolved} of {found.of} | {other[0]} | {found.speed:.3f} | {other[1]} "
            f"| {found.longest_ms:.1f} | {100 * found.spent:.0f} % | {', '.join(said)} |",
            flush=True,
        )
    print(f"\n{ran} cells, {wrong} with faults")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
