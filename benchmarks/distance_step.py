"""Compares the processor times of a tick (controller, plant, telemetry) with and without distances. The two
kinds of ticks alternate in one process: `python -m benchmarks.distance_step [SCENE ...]`.

Each scene runs twice: at its home posture, and with its first target dragged 0.7 m down in the first tick, so
that the rows hold the arm above the floor.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from time import thread_time_ns

import numpy as np

from lessons.events import MoveTarget
from lessons.scenes.catalog import torque_scene
from lessons.scenes.torque_scene import TorqueScene
from lessons.session.torque import TorqueSession
from lessons.settings.assignments import with_assignments

TICKS, FIRST = 3000, 300
"""The number of ticks, and the number of first ticks that are not counted."""
DOWN = 0.7
"""The distance by which the target is dragged down, m."""


def sessions(scene: TorqueScene, dragged: bool) -> list[TorqueSession]:
    """Returns two sessions of the scene, with and without rows of distances."""
    found = []
    for on in ("true", "false"):
        settings = with_assignments(scene.settings, [f"avoidance.on={on}"])
        session = TorqueSession(replace(scene, settings=settings))
        if dragged:
            task = next(name for name in session.references if session.target(name) is not None)
            target = session.target(task)
            assert target is not None
            session.post(MoveTarget(task, tuple(target.raw + np.array((0.0, 0.0, -DOWN)))))
        found.append(session)
    return found


def measure(name: str, dragged: bool) -> str:
    """Runs both sessions alternately and returns one line with their times."""
    pair = sessions(torque_scene(name), dragged)
    steps: list[list[float]] = [[], []]
    for _ in range(TICKS):
        for times, session in zip(steps, pair, strict=True):
            started = thread_time_ns()
            session.tick()
            times.append(1e-3 * (thread_time_ns() - started))
    binding = sum(each.kind == "distance" for each in pair[0].binding())
    (rows, none), (most, most_none) = (
        np.percentile(np.array([each[FIRST:] for each in steps]), p, axis=1) for p in (50, 99)
    )
    where = f"dragged {DOWN} m down" if dragged else "at home"
    return (
        f"{name}, {where}: median {rows:.0f} and {none:.0f} us, {rows / none:.2f} times; "
        f"99 % below {most:.0f} and {most_none:.0f} us; {binding} rows bind at the end"
    )


def main() -> None:
    for name in sys.argv[1:] or ("iiwa14-hold", "panda-hold", "baxter-hold"):
        for dragged in (False, True):
            print(measure(name, dragged), flush=True)


if __name__ == "__main__":
    main()
