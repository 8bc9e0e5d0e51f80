"""The residual (28) over the horizon: free motion, the effect of increments, and the cost's Hessian."""

from __future__ import annotations

from himpc.compilation.compiled import inline_kernel
from himpc.tick.kernel.arrays import Array, IntArray
from himpc.tick.kernel.linear import dot


@inline_kernel
def free_motion(
    error: Array,
    x_dot: Array,
    x_dot_was: Array,
    period: float,
    K_p: Array,
    K_v: Array,
    on_velocity: Array,
    on_acceleration: Array,
    displacement: Array,
    velocity_d: Array,
    acceleration_d: Array,
    m: int,
    free: Array,
) -> float:
    """Computes e at knots 1 … N for Δτ = 0, (N, m), by (15) and (28); ẍ_k is the backward difference of ẋ.
    Returns the sum of all e, which is finite if all of them are finite.

    Args:
        error, x_dot, x_dot_was: x̃_k, ẋ_k and ẋ one `period` (s) ago, (m,).
        K_p, K_v: gains of (4), (m,).
        on_velocity, on_acceleration: (N, m), see `ResidualModel`.
        displacement, velocity_d, acceleration_d: the references at k … k+N, (N+1, m).
        m: number of rows of the solved tasks.
        free: the result.
    """
    total = 0.0
    for j in range(len(free)):
        for i in range(m):
            x_ddot = (x_dot[i] - x_dot_was[i]) / period
            moving = K_p[i] * error[i] + on_velocity[j, i] * x_dot[i] + on_acceleration[j, i] * x_ddot
            desired = (
                acceleration_d[j + 1, i] + K_v[i] * velocity_d[j + 1, i] + K_p[i] * displacement[j + 1, i]
            )
            free[j, i] = moving - desired
            total += free[j, i]
    return total


@inline_kernel
def effects(B: Array, U: Array, first: int, last: int, B_U: Array) -> None:
    """Computes B_j U_j of some rows, (N, m): the change of ẍ by the increments of one knot."""
    N, _, n = B.shape
    for j in range(N):
        for i in range(first, last):
            B_U[j, i] = dot(B[j, i], U[j], n)


@inline_kernel
def add_effects(C: Array, B_U: Array, first: int, last: int, row_knots: IntArray, e: Array) -> None:
    """Computes e_{k+1} += Σ_{j≤k} √Q c_{k−j} pushed_j over the knots of each row's horizon.

    Args:
        C: √Q c_l of `ResidualModel`, (m, N): the effect depends on the distance l of two knots only.
        B_U: (N, m).
        first, last: the rows.
        row_knots: number of knots in the horizon of each row (Remark 8).
        e: (N, m), changed.
    """
    for i in range(first, last):
        for k in range(row_knots[i]):
            total = e[k, i]
            for j in range(k + 1):
                total += C[i, k - j] * B_U[j, i]
            e[k, i] = total


@inline_kernel
def gather_effects(C: Array, e: Array, first: int, last: int, row_knots: IntArray, pulled: Array) -> None:
    """Computes the transpose of `add_effects`: pulled_j = Σ_{k≥j} √Q c_{k−j} e_{k+1}."""
    N = len(e)
    for i in range(first, last):
        for j in range(N):
            total = 0.0
            for k in range(j, row_knots[i]):
                total += C[i, k - j] * e[k, i]
            pulled[j, i] = total


@inline_kernel
def hessian(
    S: Array,
    projected_jacobian: Array,
    first: int,
    last: int,
    start: IntArray,
    offset: IntArray,
    rho: float,
    H: Array,
) -> float:
    """Computes H = ρ + GᵀG of a level in its own coordinates, upper triangle; returns the trace of GᵀG. G
    itself is not computed. Since C is Toeplitz, the block of knots j and l is Σ_i S_i[j, l] b_ji b_liᵀ with
    S_i = Σ_k Q c_{k−j} c_{k−l}, which only the settings change.

    Args:
        S: (m, N, N).
        projected_jacobian: b, the rows of B in the level's coordinates, (N, m, n).
        first, last: the level's rows.
        start: index of the level's first own coordinate of a knot among all coordinates of the knot, (N,).
        offset: index of the same coordinate among the level's own coordinates of all knots, (N + 1,).
        rho: ρ, the weight R of the increments.
        H: the result.
    """
    N = len(start)
    trace = 0.0
    for j in range(N):
        for a in range(offset[j], offset[j + 1]):
            row = H[a]
            row[a : offset[N]] = 0.0
            for i in range(first, last):
                mine = projected_jacobian[j, i, start[j] + a - offset[j]]
                for k in range(j, N):
                    weight = S[i, j, k] * mine
                    begin = start[k] - offset[k]
                    for b in range(max(a, offset[k]), offset[k + 1]):
                        row[b] += weight * projected_jacobian[k, i, begin + b]
            trace += row[a]
            row[a] += rho
    return trace


@inline_kernel
def apply(
    projected_jacobian: Array, x: Array, first: int, last: int, start: IntArray, offset: IntArray, B_U: Array
) -> None:
    """Computes the product of B_j and the own coordinates x, (N, m)."""
    for j in range(len(start)):
        begin = start[j] - offset[j]
        for i in range(first, last):
            total = 0.0
            for a in range(offset[j], offset[j + 1]):
                total += projected_jacobian[j, i, begin + a] * x[a]
            B_U[j, i] = total


@inline_kernel
def gather(
    projected_jacobian: Array,
    pulled: Array,
    first: int,
    last: int,
    start: IntArray,
    offset: IntArray,
    slope: Array,
) -> None:
    """Computes the transpose of `apply`: slope = Σ_i b_ji pulled_ji."""
    for j in range(len(start)):
        begin = start[j] - offset[j]
        for a in range(offset[j], offset[j + 1]):
            total = 0.0
            for i in range(first, last):
                total += projected_jacobian[j, i, begin + a] * pulled[j, i]
            slope[a] = total
