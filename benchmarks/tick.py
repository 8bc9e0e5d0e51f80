"""Measures control ticks of several variants of a scene, which take turns and are thus disturbed equally.

    python -m benchmarks.tick [SCENE …] [--variant "[CONTROLLER] [PATH=VALUE …]"]… [--first-level] [--down M]
                              [--seconds S] [--before CHECKOUT]

Processor time is measured, so that other programs do not count. Every scene has a Markdown table with a row
per variant: the median and the 99th percentile of a whole tick and of the controller's step in it, the
medians of its parts (all QPs, plant; at torque level also references and telemetry, measured beside the
tick), µs, and the ratio of the tick to that of the first variant; for each level or task the mean error in
the first and in the second half of the run, and the largest error.

--down drags the first target down in the first tick, so that limits or contacts are active. --first-level
runs those who keep the first level at velocity level: HTMPC, HTIDKC and placo. --before runs every variant in
another checkout, too. Distances cost the ratio of `--variant avoidance.on=true --variant
avoidance.on=false`, contacts that of `--variant "plant.contacts=false plant.joint_stops=false" --variant ""`.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[1]
SCENES = {False: ("iiwa14-circle", "iiwa14-hold"), True: ("ridgeback-ur10-square",)}
FIRST_LEVEL: tuple[str, ...] = (
    "htmpc", "htmpc delta_m=0.001", "htidkc", "htidkc gains=[5,0.3]", "placo first_level=hard", "placo",
    "placo first_level=soft", "placo first_level=hard gains=[5,0.3]", "placo first_level=soft gains=[5,0.3]",
)  # fmt: skip
TURN_S, UNTIMED = 0.1, 5
"""Simulated time of a turn, and the ticks of each variant that run before and are not counted."""
PARTS = ("tick", "step", "QPs", "plant", "references", "telemetry")


def child(scene: str, down: float, variants: list[str]) -> None:
    """Runs a turn of a variant for every line on stdin, and prints the parts and errors of its ticks."""
    time.perf_counter_ns = now = time.thread_time_ns  # before the controllers are imported
    from himpc.plan import write_plan
    from himpc.references import Outlook
    from lessons.events import MoveTarget
    from lessons.scenes.run_spec import RunSpec
    from lessons.session.start import begin
    from lessons.session.torque import TorqueSession

    sessions: list[Any] = []
    in_plant: list[int] = []
    for variant in variants:
        words = variant.split()
        named = next((word for word in words if "=" not in word), None)
        given = tuple(word for word in words if "=" in word)
        prepared: Any = RunSpec(scene, controller=named, set=given).prepared()
        sessions.append(session := begin(prepared))
        for _ in range(UNTIMED):
            session.tick()
        session.reset()
        session.plant.step = timed(session.plant.step, in_plant)
        if down:
            name = next(name for name in session.references if session.target(name) is not None)
            goal = session.target(name).raw - (0.0, 0.0, down)
            session.post(MoveTarget(name, tuple(goal.tolist())))
    for line in sys.stdin:
        session, ticks = sessions[int(line)], []
        until, torque = session.t + TURN_S - 1e-9, isinstance(session, TorqueSession)
        while session.t < until:
            in_plant.clear()
            started = now()
            row = session.tick()
            spent, beside = now() - started, [0, 0]
            plan = session.plan
            if torque:
                T_s, N = session.settings.T_s, session.settings.horizon
                began = now()
                for reference in session.references.values():
                    reference.preview(session.t, T_s, N)
                read = now()
                write_plan(row.copy(), session.layout, plan, Outlook(session.references, session.t, T_s, N))
                beside = [read - began, now() - read]
            qps = sum(level.time_us for level in plan.levels)
            parts = [1e-3 * spent, plan.step_us, qps, *(1e-3 * x for x in (sum(in_plant), *beside))]
            fields = (at for name, at in session.layout.fields.items() if name.startswith("error/"))
            ticks.append([*parts, *(float(np.linalg.norm(row[each])) for each in fields)])
        print(json.dumps(ticks), flush=True)


def timed(function: Any, times: list[int]) -> Any:
    """Returns a function that appends the time of each call to `times`, ns."""

    def measured(*given: Any) -> Any:
        started = time.thread_time_ns()
        found = function(*given)
        times.append(time.thread_time_ns() - started)
        return found

    return measured


def measure(
    scene: str, variants: list[str], places: dict[str, Path], seconds: float, down: float
) -> dict[tuple[str, str], list[list[float]]]:
    """Returns the parts and errors of all ticks of each variant in each checkout."""
    started = {
        name: subprocess.Popen(
            [sys.executable, __file__, scene, f"--down={down}", *(f"--variant={each}" for each in variants)],
            env=os.environ | {"PYTHONPATH": str(place), "OPENBLAS_NUM_THREADS": "1", "HIMPC_LAB_TURNS": "1"},
            cwd=place,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for name, place in places.items()
    }
    found: dict[tuple[str, str], list[list[float]]] = {(v, name): [] for v in variants for name in places}
    for _ in range(round(seconds / TURN_S)):
        for (variant, name), ticks in found.items():
            pipes = started[name]
            assert pipes.stdin is not None and pipes.stdout is not None
            pipes.stdin.write(f"{variants.index(variant)}\n")
            pipes.stdin.flush()
            ticks += json.loads(pipes.stdout.readline())
    for process in started.values():
        process.communicate()
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("scenes", nargs="*")
    parser.add_argument("--variant", action="append", dest="variants")
    parser.add_argument("--first-level", action="store_true")
    parser.add_argument("--down", type=float, default=0.0)
    parser.add_argument("--seconds", type=float)
    parser.add_argument("--before", type=Path)
    options = parser.parse_args()
    variants = options.variants or (list(FIRST_LEVEL) if options.first_level else [""])
    if "HIMPC_LAB_TURNS" in os.environ:
        child(options.scenes[0], options.down, variants)
        return
    places = {"": ROOT} | ({" (before)": options.before.resolve()} if options.before else {})
    seconds = options.seconds or (16.0 if options.first_level else 3.0)
    for scene in options.scenes or SCENES[options.first_level]:
        found = measure(scene, variants, places, seconds, options.down)
        head = (scene, "tick, p99", "step, p99", *PARTS[2:], "ratio", "errors: halves, largest")
        print(f"\n| {' | '.join(head)} |")
        print(f"|---|{'--:|' * (len(PARTS) + 1)}---|")
        first = None
        for (variant, place), ticks in found.items():
            times, errors = np.split(np.array(ticks).T, [len(PARTS)])
            median, rare = np.percentile(times, (50, 99), axis=1)
            first = first or median[0]
            halves = "; ".join(
                ", ".join(f"{of:.5f}" for of in (*(half.mean() for half in np.array_split(x, 2)), x.max()))
                for x in errors
            )
            shown = [f"{x:.0f}, {y:.0f}" for x, y in zip(median[:2], rare[:2], strict=True)]
            shown += [f"{x:.0f}" for x in median[2:]]
            cells = (f"{variant or 'as it is'}{place}", *shown, f"{median[0] / first:.2f}", halves)
            print(f"| {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
