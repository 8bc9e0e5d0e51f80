"""Computes increments if rows of distances cannot be satisfied: the violation of these rows is minimised by
least squares."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from himpc.limits.rows import Rows
from himpc.qp import solve_qp

Array = NDArray[np.float64]

_ITERATIONS = 100
"""Largest number of iterations of the QP, which has one unknown for each joint and each direction."""
FAINT = 1e-5
"""Weight of the change of torque in the cost of the QP."""


def kept_apart(rows: Rows, joints: int, U: Array) -> Array:
    """Returns U, (N, n) N·m, with a changed first increment. The change minimises, by least squares, the
    violation of the rows whose columns are not the joints. Rows of joints that U satisfies stay satisfied.

    A step of torque changes the value of a row in proportion to L[:, 0]. With one unknown x per joint, the
    joints' own rows become bounds on x, which x = 0 satisfies. The rows of a direction D_c become one bound
    on D_c·x: the tightest bound of all knots.

    Args:
        rows: all rows.
        joints: number of rows, from the first on, whose columns are the joints.
        U: the increments before the change.
    """
    N, n = U.shape
    profile, value = rows.L[:, :1], rows.values(U)
    with np.errstate(divide="ignore", invalid="ignore"):
        low = np.where(profile > 0.0, (rows.lower - value) / profile, -np.inf)
        high = np.where(profile > 0.0, (rows.upper - value) / profile, np.inf)
    least = np.minimum(low[:joints].max(axis=0), 0.0)
    most = np.maximum(high[:joints].min(axis=0), 0.0)
    D, lower, upper = [], [], []
    for index in range(joints // N, len(rows.constraints)):
        directions, block = (
            rows.directions[index] if rows.directions else None,
            slice(index * N, (index + 1) * N),
        )
        D.append(np.eye(n) if directions is None else directions.D)
        lower.append(low[block].max(axis=0))
        upper.append(high[block].min(axis=0))
    normals, lower, upper = np.vstack(D), np.concatenate(lower), np.concatenate(upper)
    if not ((lower > 0.0) | (upper < 0.0)).any():
        return U
    bounded = np.isfinite(lower) | np.isfinite(upper)
    normals, lower, upper = normals[bounded], lower[bounded], upper[bounded]
    c = len(normals)
    H = np.diag(np.r_[np.full(n, FAINT), np.ones(c)])
    A = np.block([[np.eye(n), np.zeros((n, c))], [normals, np.eye(c)]])
    solution = solve_qp(H, np.zeros(n + c), A, np.r_[least, lower], np.r_[most, upper], "daqp", _ITERATIONS)
    moved = U.copy()
    if np.isfinite(solution.x).all():
        moved[0] += np.minimum(np.maximum(solution.x[:n], least), most)
    return moved
