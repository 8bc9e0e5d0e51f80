"""Measures the leak between levels, for which the plant's inertia must be known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from himpc.kinematics.configuration import Configuration
from himpc.plan import AtOnce, Plan
from himpc.stack import Stack

Array = NDArray[np.float64]


def dynamic_leak(M: Array, done: AtOnce) -> float:
    """max over p of ‖J_p M⁻¹(τ − τ_{≤p})‖∞ with the plant's M: the true effect of the lower levels on level
    p.

    Args:
        M: the plant's mass matrix, (n, n).
        done: at least two levels, with the increments τ_{≤p} − τ₀ of each.
    """
    first = done.increments
    acceleration = np.linalg.solve(M, (first[-1] - first[:-1]).T).T
    effects = (np.abs(J @ a).max() for J, a in zip(done.jacobians, acceleration, strict=True) if len(J))
    return float(max(effects, default=0.0))


def at_once(plan: Plan, stack: Stack, configuration: Configuration) -> AtOnce:
    """`Plan.at_once` for a controller whose plan does not have it.

    Args:
        plan: only its levels are used.
        stack: the levels' tasks.
        configuration: the plant's true positions.
    """
    tasks = {level.name: level.tasks for level in stack}
    nothing = np.empty((0, configuration.q.size))
    return AtOnce(
        np.array([level.U[0] for level in plan.levels]),
        [
            np.concatenate(
                [nothing, *(task.jacobian(configuration)[0] for task in tasks.get(level.name, ()))]
            )
            for level in plan.levels[:-1]
        ],
    )
