"""What only someone who knows the plant's inertia can tell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from himpc.configuration import Configuration
from himpc.plan import Plan
from himpc.stack import Stack

Array = NDArray[np.float64]


def dynamic_leak(M: Array, plan: Plan, stack: Stack, configuration: Configuration) -> float:
    """max over p of ‖J_p M⁻¹(τ − τ_{≤p})‖∞ with the plant's M: what lower levels really do to level p.

    Args:
        M: the plant's mass matrix, (n, n).
        plan: at least two levels; their increments stand for τ_{≤p}.
        stack: the levels' tasks.
        configuration: the plant's true positions.
    """
    first = np.array([level.U[0] for level in plan.levels])
    acceleration = np.linalg.solve(M, (first[-1] - first[:-1]).T)
    tasks = {level.name: level.tasks for level in stack}
    leak = 0.0
    for level, column in zip(plan.levels[:-1], acceleration.T, strict=True):
        for task in tasks.get(level.name, ()):
            leak = max(leak, float(np.abs(task.jacobian(configuration)[0] @ column).max()))
    return leak
