"""Compares the kernel and the printed equations with the exact optimum, for random stacks on every robot.

    python -m benchmarks.oracle [--stacks 200] [--seed 0] [--longest 30]

A stack has one to four levels with random tasks, weights (Q over five decades, R on the torque or on the
acceleration), horizons and limits, in a random state and with random targets. The kernel and
the printed equations solve the problem of the controller at that tick, and `benchmarks.exact` computes the
optimum. The program prints a row per robot: how often one of the two returned no point although there is an
optimum, and the distance of its points from the optimum, N·m.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import tyro

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # several threads are slower on such small matrices

import numpy as np
from numpy.typing import NDArray

from benchmarks.every_task import entry, scene_of
from benchmarks.exact import Exact, optimum
from himpc import HIMPC
from himpc.cascade.level import NO_ROWS, LevelProblem, LevelSolution
from himpc.controllers.printed_tick import solve
from himpc.limits import Rows, build_rows
from himpc.limits.rest import least_slack
from himpc.prediction import JointState
from himpc.references import Outlook
from himpc.tasks import KINDS
from himpc.tick.problems import solve_problems
from lessons.scenes.catalog import prepared
from lessons.session.torque import TorqueSession
from lessons.settings.assignments import assignment
from robots import CATALOG

Array = NDArray[np.float64]
METHODS = ("compiled", "printed")


@dataclass(frozen=True, eq=False)
class Stack:
    """The problem of a controller at one tick."""

    robot: str
    seed: int
    problems: list[LevelProblem]
    rows: Rows

    def solve(self, by: str) -> list[LevelSolution]:
        if by == "compiled":
            return solve_problems(self.problems, self.rows, {})
        return solve(self.problems, self.rows.matrix, self.rows, {})


@dataclass(frozen=True)
class Found:
    """The results at one level: the number of bounds that are active at the optimum, and the distances of the
    points of the kernel and of the printed equations from the optimum, N·m. A distance is None if there is no
    point."""

    robot: str
    seed: int
    level: int
    horizon: int
    active: int
    compiled: float | None
    printed: float | None


def random_stack(robot: str, seed: int, longest: int) -> Stack | None:
    """Returns a random stack that has a solution; None if no torque satisfies all limits in this state."""
    rng = np.random.default_rng(seed)
    scene = scene_of(robot)
    kinds = [kind for kind in KINDS if kind != "damping"]
    levels = int(rng.integers(1, 5))

    def decades(low: float, high: float) -> float:
        return float(10.0 ** rng.uniform(low, high))

    stack = [
        entry(str(rng.choice(kinds)), scene)
        | {"name": f"x{place}", "Q": decades(0.0, 5.0), "R": decades(-1.0, 2.0)}
        | {"K_p": decades(0.0, 2.5), "K_v": decades(0.0, 1.5)}
        for place in range(levels)
    ]
    given = {
        "stack": stack,
        "horizon": int(rng.integers(1, longest + 1)),
        "R_on": str(rng.choice(["torque", "acceleration"])),
        "limits.velocity_scale": float(rng.choice([1.0, 0.3, 0.1])),
        "limits.torque_scale": float(rng.choice([1.0, 0.5])),
    }
    settings = [assignment(path, value) for path, value in given.items()]
    session = TorqueSession(prepared(scene, "himpc", settings))
    controller = session.controller
    assert isinstance(controller, HIMPC)
    own, model = session.settings, session.robot
    narrow = np.minimum(model.v_limit, 1e3) * own.limits.velocity_scale
    q = session.plant.q + rng.normal(0.0, 0.1, model.n)
    v = rng.uniform(-0.8, 0.8, model.n) * narrow
    plan = controller.step(q, v, Outlook(session.references, 0.0, own.T_s, own.horizon))
    problems = controller.problems
    state = JointState(q, v, np.zeros(model.n))
    rows = build_rows(state, plan.tau_0, np.array(own.M_bar), own.limits, plan.limits, own.horizon, own.T_s)
    if not problems or least_slack(rows).any():
        return None
    return Stack(robot, seed, problems, rows)


def judged(stack: Stack) -> list[Found] | None:
    """Returns one row per level; None if the exact optimum was not found."""
    solutions = {by: stack.solve(by) for by in METHODS}
    above: list[tuple[LevelProblem, Exact]] = []
    found = []
    right = dict.fromkeys(METHODS, True)
    for place, problem in enumerate(stack.problems):
        points = {by: solutions[by][place] for by in METHODS}
        best = None
        for guess in (points["printed"].active, points["compiled"].active, NO_ROWS):
            best = best or optimum(problem, stack.rows, above, guess)
        if best is None:
            return None
        for by in METHODS:  # after a level without a point, the next problem differs
            right[by] = right[by] and points[by].fallback == "solve"
        errors = [float(np.abs(points[by].U - best.U).max()) if right[by] else None for by in METHODS]
        found.append(Found(stack.robot, stack.seed, place + 1, len(problem.B), best.active, *errors))
        above.append((problem, best))
    return found


def stacks(count: int, seed: int, longest: int, robots: tuple[str, ...]) -> Iterator[Stack]:
    """Yields random stacks, for each robot in turn."""
    done = 0
    while done < count:
        stack = random_stack(robots[done % len(robots)], seed, longest)
        seed += 1
        if stack is not None:
            done += 1
            yield stack


def table(found: list[Found]) -> str:
    """Returns one row per robot, in Markdown."""
    lines = [
        "| robot | levels, at a bound | compiled: no point, worst error | printed: no point, worst error |",
        "|---|--:|--:|--:|",
    ]
    for robot in [*dict.fromkeys(each.robot for each in found), "all"]:
        rows = [each for each in found if robot in (each.robot, "all")]
        cells = []
        for by in METHODS:
            errors = [error for each in rows if (error := getattr(each, by)) is not None]
            cells.append(f"{len(rows) - len(errors)}, {max(errors, default=0.0):.1e}")
        held = sum(each.active > 0 for each in rows)
        lines.append(f"| {robot} | {len(rows)}, {held} | {cells[0]} | {cells[1]} |")
    return "\n".join(lines)


def main(
    count: Annotated[int, tyro.conf.arg(name="stacks")] = 200,
    seed: int = 0,
    longest: int = 30,
    robot: str | None = None,
) -> int:
    """Does what the module says."""
    robots = tuple(CATALOG) if robot is None else (robot,)
    found, unknown = [], 0
    for stack in stacks(count, seed, longest, robots):
        rows = judged(stack)
        if rows is None:
            unknown += 1
            print(f"{stack.robot} --seed {stack.seed}: the optimum was not found", file=sys.stderr)
            continue
        found += rows
        for each in rows:
            if any(error is None or error > 1e-6 for error in (each.compiled, each.printed)):
                print(each, file=sys.stderr, flush=True)
    print(table(found))
    print(f"{count} stacks, for {unknown} of them the optimum was not found", file=sys.stderr)
    return 1 if unknown else 0


if __name__ == "__main__":
    sys.exit(tyro.cli(main, description=__doc__))
