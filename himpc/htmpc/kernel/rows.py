"""Compiled rows of (7d), and rows of functions of q, with respect to the condensed inputs."""

from __future__ import annotations

import math

from himpc.compilation.compiled import (
    FIXED,
    FIXED_VECTOR,
    FLAG,
    GIVEN_MATRIX,
    GIVEN_VECTOR,
    INDICES,
    MATRICES,
    MATRIX,
    NUMBER,
    TABLE,
    VECTOR,
    WHOLE,
    kernel,
)
from himpc.compilation.views import borrowed
from himpc.htmpc.kernel.kinds import ACCELERATION, JERK, LEXICOGRAPHIC, POSITION, RAMP, STOP, VELOCITY
from himpc.tick.kernel.linear import dot
from robots.arrays import Array, Indices, Integers

RAMP_STEPS = 10
"""Largest number of knots beyond the horizon within which the input returns to zero."""
STOP_STEPS = 40
"""Largest number of knots beyond the horizon for which braking is checked."""


@kernel(MATRIX, WHOLE, INDICES, MATRIX, FIXED)
def spread(A: Array, index: int, knot: Indices, slopes: Array, T_q: Array) -> None:
    """Writes rows of functions of q to A (…, N·n), from `index` on. `slopes` (r, n) are the derivatives of
    the functions with respect to q at the knots (r,)."""
    n = slopes.shape[1]
    for r in range(len(knot)):
        for s in range(len(T_q)):
            for j in range(n):
                A[index + r, s * n + j] = T_q[knot[r], s] * slopes[r, j]


@kernel(MATRIX, MATRIX, VECTOR, WHOLE, MATRIX)
def about(A: Array, bounds: Array, u: Array, count: int, room: Array) -> None:
    """Writes the bounds on the change d of u to `room`, for the first `count` rows: lower − Au ≤ A d ≤ upper
    − Au."""
    A, u = borrowed(A), borrowed(u)
    for r in range(count):
        value = dot(A[r], u, len(u))
        room[0, r], room[1, r] = bounds[0, r] - value, bounds[1, r] - value


@kernel(MATRICES, GIVEN_MATRIX, GIVEN_MATRIX, FLAG, FIXED, WHOLE, MATRIX, MATRIX, TABLE)
def guard(
    J: Array,
    e: Array,
    best: Array,
    strict: bool,
    T_q: Array,
    index: int,
    A: Array,
    room: Array,
    labels: Integers,
) -> None:
    """Writes (12), |e + J T_q d| ≤ |e*| in every coordinate and knot, to a table from row `index` on.

    Args:
        J, e: (N, m, n) and (N, m), the error of a level above at the iterate. best: e*, (N, m).
        strict: whether an error that exceeds e* must return to e*. Otherwise it may keep its size. If strict,
            the rows of A must have been written before.
        T_q: (N, N), ∂q_k/∂u_s. A, room, labels: arrays of the table.
    """
    N, m, n = J.shape
    for k in range(N):
        for p in range(m):
            r = index + k * m + p
            if not strict:
                for s in range(N):
                    for j in range(n):
                        A[r, s * n + j] = T_q[k, s] * J[k, p, j]
            reach = abs(best[k, p])
            if not strict:
                reach = max(reach, abs(e[k, p]))
            room[0, r], room[1, r] = -reach - e[k, p], reach - e[k, p]
            labels[0, r], labels[1, r], labels[2, r] = LEXICOGRAPHIC, k + 1, p


@kernel(
    *(FIXED, FIXED, FIXED_VECTOR, GIVEN_VECTOR, GIVEN_VECTOR, GIVEN_VECTOR),
    *(GIVEN_VECTOR, GIVEN_VECTOR, GIVEN_VECTOR, GIVEN_VECTOR, GIVEN_VECTOR, NUMBER, NUMBER),
    *(MATRIX, MATRIX, TABLE),
)
def limits(
    T_v: Array,
    T_q: Array,
    t: Array,
    q: Array,
    v: Array,
    u: Array,
    q_lower: Array,
    q_upper: Array,
    v_max: Array,
    a_max: Array,
    j_max: Array,
    period: float,
    dt: float,
    A: Array,
    bounds: Array,
    labels: Integers,
) -> int:
    """Writes the rows of `limit_rows` to the beginning of a table; returns their number."""
    N, n = len(t), len(q)
    T, count = t[N - 1], 0
    for kind in range(4):
        for k in range(N):
            for i in range(n):
                a = a_max[i]
                if kind == VELOCITY:
                    middle, low, high, reach = v[i], -v_max[i], v_max[i], t[k] * a
                elif kind == POSITION:
                    middle, low, high = q[i] + t[k] * v[i], q_lower[i], q_upper[i]
                    reach = 0.5 * t[k] ** 2 * a
                elif kind == ACCELERATION:
                    middle, low, high, reach = 0.0, -a, a, math.inf
                else:
                    change = j_max[i] * (min(period, dt) if k == 0 else dt)
                    middle, low, high = -u[i] if k == 0 else 0.0, -change, change
                    reach = a + abs(u[i]) if k == 0 else 2.0 * a
                low, high = low - middle, high - middle
                if (math.isfinite(low) or math.isfinite(high)) and (high < reach or low > -reach):
                    A[count] = 0.0
                    if kind <= POSITION:
                        for s in range(k + 1):
                            A[count, s * n + i] = T_v[k, s] if kind == VELOCITY else T_q[k, s]
                    else:
                        A[count, k * n + i] = 1.0
                        if kind == JERK and k > 0:
                            A[count, (k - 1) * n + i] = -1.0
                    bounds[0, count], bounds[1, count] = low, high
                    labels[0, count], labels[1, count], labels[2, count] = kind, k + (kind <= POSITION), i
                    count += 1
    # "ramp": |v_N ± Δt (m u_{N−1} − j Δt m(m+1)/2)| ≤ v_max, the speed while the input returns to zero.
    for i in range(n):
        step = j_max[i] * dt
        if not (math.isfinite(step) and math.isfinite(v_max[i]) and a_max[i] > step):
            continue
        for m in range(1, math.ceil(min(a_max[i] / step, RAMP_STEPS)) + 1):
            A[count] = 0.0
            for s in range(N):
                A[count, s * n + i] = T_v[N - 1, s]
            A[count, (N - 1) * n + i] += m * dt
            room = v_max[i] + dt * step * m * (m + 1) / 2
            bounds[0, count], bounds[1, count] = -room - v[i], room - v[i]
            labels[0, count], labels[1, count], labels[2, count] = RAMP, N, i
            count += 1
    # "stop": q_N + mΔt v_N ∓ ½a(mΔt)², the position after m steps of full braking, is inside the range. A row
    # is left out if the fastest motion within the input bounds does not reach the row's bound.
    for m in range(1, STOP_STEPS + 1):
        ahead = m * dt
        for i in range(n):
            a = a_max[i]
            if not (math.isfinite(a) and (math.isfinite(q_lower[i]) or math.isfinite(q_upper[i]))):
                continue
            fastest = min(v_max[i], abs(v[i]) + a * T)
            if not ahead < fastest / a + dt:
                continue
            end, brake = q[i] + T * v[i], 0.5 * a * ahead**2
            far = 0.5 * a * T**2 + ahead * fastest - brake
            if not (end + far > q_upper[i] or end - far < q_lower[i]):
                continue
            A[count] = 0.0
            for s in range(N):
                A[count, s * n + i] = T_q[N - 1, s] + ahead * T_v[N - 1, s]
            coasting = end + ahead * v[i]
            bounds[0, count] = q_lower[i] - brake - coasting
            bounds[1, count] = q_upper[i] + brake - coasting
            labels[0, count], labels[1, count], labels[2, count] = STOP, N, i
            count += 1
    return count
