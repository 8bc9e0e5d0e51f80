"""Limits the errors on which tasks act while distances are kept, see `Avoidance.pull`."""

from __future__ import annotations

import math

from himpc.compilation.compiled import inline_kernel
from himpc.constants import TURN_PULL
from himpc.tick.kernel.arrays import Array, IntArray
from himpc.tick.kernel.kinematics import POSITION


@inline_kernel
def bounded_pull(task: IntArray, error: Array, pull: float, K_p: Array, m: int, free: Array) -> None:
    """Removes from the free motion the part of the errors beyond `pull`, see `StackForm.pulling`.

    Args:
        task: see `jacobian`. error: x̃_k, (M,). K_p: (M,).
        pull: the largest error on which a position task acts, m; for other tasks the largest error is
            TURN_PULL · pull, rad.
        m: number of rows of the solved tasks.
        free: (N, M), updated.
    """
    for p in range(len(task)):
        first, last = task[p, 2], min(task[p, 2] + task[p, 3], m)
        squares = 0.0
        for i in range(first, last):
            squares += error[i] * error[i]
        most = pull if task[p, 0] == POSITION else TURN_PULL * pull
        if not squares > most * most:
            continue
        beyond = 1.0 - most / math.sqrt(squares)
        for i in range(first, last):
            for j in range(len(free)):
                free[j, i] -= K_p[i] * beyond * error[i]
