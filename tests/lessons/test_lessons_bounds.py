"""A level without an optimum is not worse than the feasible points that are known."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.bounds import Cell, drag, session_of
from himpc.cascade.last_resort import containing
from himpc.limits.braking import missed


def test_a_level_without_an_optimum_is_not_worse_than_its_continued_plan() -> None:
    """The kernel has too small a budget for most levels. If the increments that continue a level's plan, with
    those of the levels above, satisfy all rows, then the level's own increments do not cost more."""
    session: Any = session_of(Cell("iiwa14-hold", 10, 0.1, 1.0), "compiled")
    rng, before, compared = np.random.default_rng(0), None, 0
    for tick in range(90):
        if tick % 80 == 10:
            drag(session, rng)
            session.controller.kernel.budget = 4e5
        session.tick()
        plan, problems = session.plan, session.controller.problems
        for place in range(1, len(plan.levels)):
            level, above = plan.levels[place], plan.levels[place - 1].U
            if level.fallback == "solve" or before is None:
                continue
            change = np.zeros_like(above)
            change[:-1] = (before[place].U - before[place - 1].U)[1:]
            B = np.concatenate([problem.B for problem in problems[:place]], axis=1)
            root = np.sqrt(problems[place].R)
            scaled = B / root
            inner = (root * change)[:, :, None]
            continued = above + (inner - np.linalg.pinv(scaled) @ (scaled @ inner))[:, :, 0] / root
            cost = problems[place].cost
            assert cost(level.U) <= cost(above) * (1.0 + 1e-9)
            if not missed(containing(plan.rows, above), continued).any():
                compared += cost(continued) < cost(above)
                assert cost(level.U) <= cost(continued) * (1.0 + 1e-6)
        before = plan.levels
    assert compared
