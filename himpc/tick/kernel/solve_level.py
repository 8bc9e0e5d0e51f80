"""Entry: one level of the cascade."""

from __future__ import annotations

from typing import Any

from himpc.compilation.compiled import INDICES, NUMBER, VECTOR, WHOLE, kernel
from himpc.compilation.views import matrices, matrix, vector
from himpc.tick.kernel.active_set import ActiveSet
from himpc.tick.kernel.arena import AT, WHOLE_AT, Whole
from himpc.tick.kernel.cascade import (
    ALONE,
    FIRST,
    KNOTS,
    LAST,
    count_coordinates,
    own_directions,
    solve_problem,
)
from himpc.tick.kernel.goldfarb_idnani import FAILED
from himpc.tick.kernel.level import LevelQP

_SHARE = 0.75
"""What one attempt at a level may take of what is left, so that levels below it get theirs; the last one may
take all."""


@kernel(VECTOR, INDICES, INDICES, INDICES, WHOLE, NUMBER)
def solve_level(data: Any, where: Whole, whole: Whole, whole_where: Whole, i: int, room: float) -> bool:
    """Problem i of the cascade, those above it known; False if no optimum was found within what is left of
    the tick's budget.

    room: N·m by which bounds give way where the levels above leave none. Positive only to try a level once
        more: its directions stand from the first attempt and would else count as those of a level above.
    """
    s = vector(whole, whole_where[WHOLE_AT.sizes], 10)
    n, N, M, r, b, w = s[0], s[1], s[2], s[4], s[7], s[8]
    k = w + 1
    levels = matrix(whole, whole_where[WHOLE_AT.level], r, 8)
    B, free = matrices(data, where[AT.B], N, M, n), matrix(data, where[AT.free], N, M)
    root_Q, U = vector(data, where[AT.root_Q], M), matrices(data, where[AT.U], r, N, n)
    Q, reflector = matrices(data, where[AT.Q], N, n, n), matrices(data, where[AT.reflector], N, n, n)
    projected_jacobian, metric = (
        matrices(data, where[AT.projected_jacobian], N, M, n),
        matrix(data, where[AT.metric], r, n),
    )
    count, start = (
        vector(whole, whole_where[WHOLE_AT.count], N),
        vector(whole, whole_where[WHOLE_AT.start], N),
    )
    offset, rest = (
        vector(whole, whole_where[WHOLE_AT.offset], N + 1),
        vector(whole, whole_where[WHOLE_AT.rest], N + 1),
    )
    active = ActiveSet(
        vector(whole, whole_where[WHOLE_AT.held_row], k),
        vector(whole, whole_where[WHOLE_AT.held_joint], k),
        vector(whole, whole_where[WHOLE_AT.held_side], k),
        matrix(data, where[AT.normal], k, w),
        matrix(data, where[AT.scaled_normal], k, w),
        matrix(data, where[AT.orthonormal_basis], k, w),
        matrix(data, where[AT.cholesky_factor], k, k),
        vector(data, where[AT.target], k),
        vector(data, where[AT.trial_multiplier], k),
        vector(data, where[AT.violation], k),
        vector(data, where[AT.change], k),
    )
    value = matrix(data, where[AT.reached], b, n)
    low, high = matrix(data, where[AT.low], b, n), matrix(data, where[AT.high], b, n)
    warm_row, warm_joint = (
        matrix(whole, whole_where[WHOLE_AT.warm_row], r, k),
        matrix(whole, whole_where[WHOLE_AT.warm_joint], r, k),
    )
    warm_count, warm_multiplier = (
        vector(whole, whole_where[WHOLE_AT.warm_count], r),
        matrix(data, where[AT.warm_multiplier], r, k),
    )
    active_row, active_joint = (
        matrix(whole, whole_where[WHOLE_AT.active_row], r, k),
        matrix(whole, whole_where[WHOLE_AT.active_joint], r, k),
    )
    multiplier, slack = matrix(data, where[AT.multiplier], r, k), matrix(data, where[AT.slack], r, k)
    if not room > 0.0:
        own_directions(i, levels, B, metric[i], reflector, Q, projected_jacobian, count, start)
        left = count_coordinates(levels[i, KNOTS], n, count, start, offset, rest)
        whole[whole_where[WHOLE_AT.left] + i] = left
    level = LevelQP(
        levels[i, FIRST],
        levels[i, LAST],
        data[where[AT.rho] + i],
        data[where[AT.accuracy] + i],
        matrix(data, where[AT.C], M, N),
        matrices(data, where[AT.S], M, N, N),
        vector(whole, whole_where[WHOLE_AT.row_knots], M),
        projected_jacobian,
        matrix(data, where[AT.e_0], N, M),
        matrix(data, where[AT.e_1], N, M),
        matrix(data, where[AT.pushed], N, M),
        start,
        offset,
        rest,
        matrix(data, where[AT.fixed], N, n),
        Q,
        metric[i],
        matrix(data, where[AT.H], w, w),
        vector(data, where[AT.x], w),
        vector(data, where[AT.z], w),
        vector(data, where[AT.slope], w),
        vector(data, where[AT.size], 2),
    )
    granted = data[where[AT.budget]]
    spared = 0.0 if i == r - 1 or levels[i, ALONE] else (1.0 - _SHARE) * granted
    data[where[AT.budget]] = granted - spared
    kkt, held = solve_problem(
        i,
        levels,
        level,
        active,
        B,
        free,
        root_Q,
        U,
        warm_count[i],
        warm_row[i],
        warm_joint[i],
        warm_multiplier[i],
        matrix(data, where[AT.L], b, N),
        matrix(data, where[AT.lower], b, n),
        matrix(data, where[AT.upper], b, n),
        low,
        high,
        value,
        matrix(data, where[AT.length], b, n),
        vector(data, where[AT.ideal], w),
        vector(data, where[AT.budget], 1),
        room,
    )
    data[where[AT.budget]] += spared
    if kkt == FAILED:
        # The next attempt, now or a tick later, goes on from where this one got.
        warm_count[i] = held
        for p in range(held):
            warm_row[i, p], warm_joint[i, p] = active.row[p], active.joint[p]
            warm_multiplier[i, p] = active.multiplier[p]
        return False
    data[where[AT.kkt] + i] = kkt
    whole[whole_where[WHOLE_AT.active_count] + i] = held
    for p in range(held):
        row, joint = active.row[p], active.joint[p]
        active_row[i, p], active_joint[i, p], multiplier[i, p] = row, joint, active.multiplier[p]
        slack[i, p] = (
            high[row, joint] - value[row, joint]
            if active.side[p] > 0
            else value[row, joint] - low[row, joint]
        )
    return True
