"""Relaxed bounds, and increments that bring the joints to rest, for each joint separately. The formulas are
those of `himpc.limits.rest`."""

from __future__ import annotations

import math

from himpc.cascade.last_resort import ROOM
from himpc.compilation.compiled import inline_kernel
from himpc.export.kernel.apart import keep_apart
from himpc.export.kernel.loop_arrays import LoopArrays
from himpc.export.kernel.rows import constraints_of, joint_rows
from himpc.limits.rest import MET
from himpc.limits.rows import BRAKING
from himpc.tick.kernel.arrays import PERIOD, T_S, Array, TickArrays
from himpc.tick.kernel.bounds import constraint_values
from himpc.tick.kernel.pair_arrays import PairArrays

_ROUNDING = 1e-14
"""A row is satisfied if its violation is less than this share of the sum of the magnitudes of its terms."""


@inline_kernel
def clamp(x: float, low: float, high: float) -> float:
    """Returns x limited to the bounds. If the bounds contradict each other, the upper bound holds."""
    return min(max(x, low), high)


@inline_kernel
def braking(t: TickArrays, p: LoopArrays, d: PairArrays, U: Array) -> None:
    """Computes increments (N, n) that always satisfy the torque rows, and also the velocity rows if this is
    possible. Of the position rows, each knot uses only the next one. The bounds are `lower` and `upper` of
    the tick. Rows of distances are met if one step of torque suffices, see `keep_apart`."""
    N, n = U.shape
    T_s, kinds = t.scalars[T_S], joint_rows(t) // N
    for a in range(n):
        for j in range(N):
            p.low[j, a], p.high[j, a] = t.lower[N + j, a], t.upper[N + j, a]
        for j in range(N - 2, -1, -1):
            behind_low, behind_high = (
                p.low[j + 1, a] - t.upper[j + 1, a],
                p.high[j + 1, a] - t.lower[j + 1, a],
            )
            low, high = p.low[j, a], p.high[j, a]
            p.low[j, a], p.high[j, a] = clamp(behind_low, low, high), clamp(behind_high, low, high)
        q_dd = (t.v[a] - t.v_was[a]) / t.scalars[PERIOD]
        before = position = 0.0
        for j in range(N):
            time = T_s * (j + 1.0)
            rest = (math.expm1(-BRAKING * time) * t.v[a] - time * q_dd) * (t.M_bar[a] / T_s)
            wanted = clamp(rest, p.low[j, a], p.high[j, a])
            if kinds == 3 and j + 1 < N:
                row = 2 * N + j + 1
                wanted = clamp(wanted, t.lower[row, a] - position, t.upper[row, a] - position)
            before = clamp(wanted, before + t.lower[j, a], before + t.upper[j, a])
            p.w[j, a] = before
            position += before
        gained = 0.0
        for j in range(N):
            # The increments are the second differences of w.
            step = p.w[j, a] - (p.w[j - 1, a] if j else 0.0)
            U[j, a] = step - gained
            gained = step
    keep_apart(t, d, U)


@inline_kernel
def missed(t: TickArrays, p: LoopArrays, U: Array) -> float:
    """Computes by how much the increments U violate each row, and writes these violations to `size`, (b, n) ≥
    0 N·m. Returns the largest violation. A violation that is only rounding counts as 0."""
    N, n = U.shape
    for j in range(N):
        for a in range(n):
            p.wanted[j, a] = abs(U[j, a])
    constraint_values(p.wanted, constraints_of(t, p.size))
    for row in range(joint_rows(t), len(t.L)):
        # The terms of a row of a distance are those of all joints.
        D = t.direction[0]
        for c in range(n):
            p.size[row, c] = 0.0
            for j in range(N):
                for a in range(n):
                    p.size[row, c] += t.L[row, j] * abs(D[c, a]) * p.wanted[j, a]
    constraint_values(U, constraints_of(t, t.reached))
    worst = 0.0
    for row in range(len(t.L)):
        for a in range(n):
            excess = max(t.reached[row, a] - t.upper[row, a], t.lower[row, a] - t.reached[row, a], 0.0)
            p.size[row, a] = excess if excess > _ROUNDING * len(t.L) * p.size[row, a] else 0.0
            worst = max(worst, p.size[row, a])
    return worst


@inline_kernel
def soften(t: TickArrays, p: LoopArrays, d: PairArrays) -> bool:
    """Widens all rows but those of torque by the least slack that makes them feasible; returns False if they
    are feasible."""
    N, n = p.trial.shape
    braking(t, p, d, p.trial)
    missed(t, p, p.trial)
    enough = MET if len(t.L) >= 3 * N else 0.0
    widened = False
    for row in range(N, len(t.L)):
        for a in range(n):
            slack = p.size[row, a]
            if slack > enough:
                t.lower[row, a] -= slack + ROOM
                t.upper[row, a] += slack + ROOM
                widened = True
    return widened
