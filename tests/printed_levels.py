"""Compares the levels of a controller's last tick with the printed equations."""

from __future__ import annotations

import numpy as np

from himpc.controllers import HIMPC, Controller, Weighted
from himpc.controllers.printed_tick import solve
from himpc.controllers.weighted import sum_of_costs
from himpc.plan import Plan


def off_printed(controller: Controller, plan: Plan) -> float:
    """Returns the largest distance of an increment of a plan from the optimum of the printed equations, N·m,
    for the problems and rows of the controller. Without priorities, only the applied level is compared."""
    assert isinstance(controller, HIMPC)
    problems, levels = controller.problems, plan.levels
    if isinstance(controller, Weighted):
        problems, levels = [sum_of_costs(problems)], levels[-1:]
    found = solve(problems, plan.rows.matrix, plan.rows, {})
    return max(float(np.abs(one.U - other.U).max()) for one, other in zip(found, levels, strict=True))
