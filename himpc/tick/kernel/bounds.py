"""The bounds (32d)–(32f) over the horizon, and the values that increments give to their rows."""

from __future__ import annotations

import math
from typing import NamedTuple

from himpc.compilation.compiled import inline_kernel
from himpc.constants import RETURN_RATE
from himpc.tick.kernel.arrays import Array
from himpc.tick.kernel.linear import dot

VIABILITY, PAPER, OFF = range(3)
"""The kinds of position limits."""


class LevelBounds(NamedTuple):
    """The bounds of a level, low ≤ L U Dᵀ ≤ high.

    Attributes:
        L: (b, N).
        low, high: (b, n) N·m.
        value: L U Dᵀ, (b, n) N·m.
        length: scratch, (b, n).
        direction: (g, n, n), D of each block of N rows from row `plain` on; before it D is the identity.
        plain: number of rows whose columns are the joints: torque, velocity and position, in this order.
    """

    L: Array
    low: Array
    high: Array
    value: Array
    length: Array
    direction: Array
    plain: int


@inline_kernel
def viable_speed(room: float, v_limit: float, a_max: float, reaction: float) -> float:
    """Returns the speed from which a joint can still stop within `room`, see `limits.velocity`. Beyond the
    limit, it returns the negative speed at which the joint must return."""
    inside = max(room, 0.0)
    reach = min(v_limit, a_max * (math.sqrt(reaction * reaction + (2.0 / a_max) * inside) - reaction))
    return reach + max(RETURN_RATE * min(room, 0.0), -v_limit)


@inline_kernel
def bounds(
    q: Array,
    v: Array,
    v_was: Array,
    tau_0: Array,
    M_bar: Array,
    limits: Array,
    approach: Array,
    mode: int,
    reaction: float,
    period: float,
    T_s: float,
    lower: Array,
    upper: Array,
    stopping: Array,
) -> None:
    """Computes the bounds on L U in N·m, the first rows of (b, n): torque (32f), velocity (32e) scaled by
    M̄/T_s and, for PAPER, position (32d) scaled by M̄/T_s²; see `limits.build_rows`. Bounds of other
    constraints are input.

    Args:
        q, v, v_was: measured state, and the velocity one `period` ago, (n,).
        tau_0: torque that acts now, (n,) N·m.
        M_bar: diagonal of M̄, (n,).
        limits: (8, n), of which the first six rows are read: torques, velocity limit, positions (of the
            limits for PAPER, otherwise of the stops), and deceleration.
        approach: largest share of the distance to a velocity bound by which a joint may approach the bound
            until knots 1 … N.
        mode: VIABILITY, PAPER or OFF.
        reaction: s, see `viable_speed`.
        period, T_s: duration of the previous and of this period, s.
        lower, upper: the result.
        stopping: (2, n), 1 where a velocity row imposes the position limit, see `Rows`.
    """
    N = approach.size
    for a in range(q.size):
        q_dd = (v[a] - v_was[a]) / period
        v_low, v_high = -limits[2, a], limits[2, a]
        if mode == VIABILITY:
            down = -viable_speed(q[a] - limits[3, a], limits[2, a], limits[5, a], reaction)
            up = viable_speed(limits[4, a] - q[a], limits[2, a], limits[5, a], reaction)
            v_low, v_high = min(down, up), max(down, up)
            stopping[0, a], stopping[1, a] = -v_low < limits[2, a], v_high < limits[2, a]
        scale = M_bar[a] / T_s
        for j in range(N):
            lower[j, a], upper[j, a] = limits[0, a] - tau_0[a], limits[1, a] - tau_0[a]
            gained = T_s * (j + 1.0) * q_dd * scale
            lower[N + j, a] = approach[j] * ((v_low - v[a]) * scale) - gained
            upper[N + j, a] = approach[j] * ((v_high - v[a]) * scale) - gained
            if mode == PAPER:
                t = T_s * (j + 1.0)
                free = q[a] + t * v[a] + 0.5 * t * (t - T_s) * q_dd
                lower[2 * N + j, a] = (limits[3, a] - free) * (scale / T_s)
                upper[2 * N + j, a] = (limits[4, a] - free) * (scale / T_s)


@inline_kernel
def constraint_values(U: Array, bounds: LevelBounds) -> None:
    """Writes L U Dᵀ to `bounds.value`. Torque rows are the running sums of the increments, velocity rows the
    running sums of torque rows, and position rows the running sums of velocity rows, one knot later. Rows of
    constraints with directions of their own follow."""
    N, n = U.shape
    value, plain = bounds.value, bounds.plain
    kinds = plain // N
    for a in range(n):
        torque, velocity, position = 0.0, 0.0, 0.0
        for j in range(N):
            torque += U[j, a]
            position += velocity
            velocity += torque
            value[j, a] = torque
            if kinds > 1:
                value[N + j, a] = velocity
            if kinds > 2:
                value[2 * N + j, a] = position
    for first in range(plain, len(value), N):
        D = bounds.direction[(first - plain) // N]
        for c in range(n):
            for j in range(N):
                value[first + j, c] = dot(D[c], U[j], n)
            # The values are replaced from the last knot to the first: each knot needs the earlier ones
            # unreplaced.
            for j in range(N - 1, -1, -1):
                total = 0.0
                for s in range(j + 1):
                    total += bounds.L[first + j, s] * value[first + s, c]
                value[first + j, c] = total
