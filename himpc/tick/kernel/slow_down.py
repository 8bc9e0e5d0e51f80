"""Entry point: computes the velocity limits of a controller that keeps distances. They are lower in three
cases.

*Load.* The torque that a motor needs to hold the robot depends on the posture. The less torque a motor has
left, the more slowly the joints that it carries approach a posture that it cannot hold.

*Overrun.* The rows of velocity assume that a joint's acceleration follows its torque at once. With time-delay
estimation the acceleration follows with a time constant of T_s times the ratio of true to assumed inertia,
0.07 s for the third joint of a panda. All rows are then satisfied, but a joint that is accelerated by the
motion of other joints overruns its limit by 36 %. The limit of such a joint is lowered until its speed no
longer increases.

*Stall.* An arm that is dragged into the floor stops above the floor, but its joints would continue to move
near their limits. They become slower while an obstacle is near, no reference moves, and no task that is away
from its target makes progress. A robot that has become slow stays slow until a reference moves, no obstacle
is near, or its first task is disturbed.
"""

from __future__ import annotations

from himpc.compilation.compiled import (
    FLAG,
    GIVEN_VECTOR,
    MATRIX,
    NUMBER,
    VECTOR,
    inline_kernel,
    kernel,
    plain,
)
from himpc.constants import (
    BLOCKED,
    CLOSE_ENOUGH,
    DISTURBED,
    FREE_LOAD,
    FULL_LOAD,
    HEAVY_LOAD,
    INSIDE,
    LEAD,
    LEAST_SHARE,
    LEAST_WHILE_FASTER,
    LOAD_SECONDS,
    MEAN_SECONDS,
    PROGRESS,
    PROGRESS_SHARE,
    RECOVERY,
    REST,
    SLOWEST,
    SLOWEST_SHARE,
    SLOWING,
    STALLED,
)
from himpc.tick.kernel.arrays import Array
from himpc.tick.kernel.linear import copy

STALL_SHARE, STALL_LEAST = range(2)
"""Indices of the numbers about the stall: 1 if the robot is not stalled and 0 if it is completely stalled;
the smallest error of the first task after the robot was last free to move."""


@inline_kernel
def update_stall(errors: Array, moves: bool, room: float, T_s: float, due: Array, stall: Array) -> None:
    """Computes the stall one period later; for the arguments see `lower_velocities`."""
    far, free = False, moves or not INSIDE <= room <= BLOCKED
    for p in range(len(errors)):
        far = far or errors[p] > CLOSE_ENOUGH
    brakes, rests = REST < stall[STALL_SHARE] < STALLED, stall[STALL_SHARE] <= REST
    if free or not far or (errors[0] > stall[STALL_LEAST] + DISTURBED and not brakes):
        copy(errors, due, len(errors))
        stall[STALL_LEAST], slows = errors[0], False
    else:
        nearer = False
        for p in range(len(errors)):
            due[p] = min(errors[p], due[p] - (PROGRESS + PROGRESS_SHARE * errors[p]) * T_s)
            nearer = nearer or (errors[p] > CLOSE_ENOUGH and errors[p] <= due[p] + CLOSE_ENOUGH)
        stall[STALL_LEAST] = errors[0] if brakes else min(errors[0], stall[STALL_LEAST])
        slows = brakes or rests or not nearer
    goal, seconds = (0.0, SLOWING) if slows else (1.0, RECOVERY)
    stall[STALL_SHARE] += min(1.0, T_s / seconds) * (goal - stall[STALL_SHARE])


@inline_kernel
def lower_velocities(
    v_limit: Array,
    largest_torque: Array,
    tau: Array,
    v: Array,
    carried: Array,
    room: float,
    moves: bool,
    T_s: float,
    size: float,
    errors: Array,
    due: Array,
    stall: Array,
    load: Array,
    mean: Array,
    slower: Array,
) -> None:
    """Updates the load, the mean velocities and the stall by one control period, and computes the velocity
    limits.

    Args:
        v_limit: (n,) rad/s, the limits without reductions. largest_torque: (n,) N·m.
        tau: torque that acts, (n,) N·m. v: measured, (n,) rad/s.
        carried: (n, n), entry [k, j]: whether the motor of joint j carries joint k.
        room: the amount by which the nearest distance exceeds d_safe, m; infinite without a near pair.
        moves: whether a reference or the obstacle moves. T_s: control period, s.
        size: see `himpc.controllers.stall_guard.size_of`.
        errors: the length of each task's error, (T,) m / size or rad. If it is empty, the stall is not
            updated.
        due: (T,) the errors that the tasks should have reached by now; updated.
        stall: numbers about the stall, see STALL_SHARE; updated.
        load: (n,) the mean load of each joint, as a share of its torque limit; updated.
        mean: (n,) rad/s, the mean velocity of each joint; updated.
        slower: (n,) rad/s; the result.
    """
    n = len(v_limit)
    heaviest, fast = -1.0, False
    for a in range(n):
        load[a] += min(1.0, T_s / LOAD_SECONDS) * (abs(tau[a]) / largest_torque[a] - load[a])
        heaviest = max(heaviest, load[a])
        mean[a] += min(1.0, T_s / MEAN_SECONDS) * (v[a] - mean[a])
    for a in range(n):
        slower[a] = v_limit[a]
        if heaviest > FREE_LOAD:
            share = 1.0
            for j in range(n):
                if carried[a, j]:
                    share = min(share, max((FULL_LOAD - load[j]) / (FULL_LOAD - FREE_LOAD), SLOWEST_SHARE))
            slower[a] *= share
        gained = (LEAD / MEAN_SECONDS) * (abs(v[a]) - abs(mean[a]))
        fast = fast or not abs(v[a]) + gained <= LEAST_WHILE_FASTER * slower[a]
    if fast:
        for a in range(n):
            gained = (LEAD / MEAN_SECONDS) * (abs(v[a]) - abs(mean[a]))
            slower[a] = max(slower[a] - max(gained, 0.0), LEAST_WHILE_FASTER * slower[a])
    if len(errors):
        near = max(room, room / size)  # not a violation: d_safe is not smaller for a smaller robot
        update_stall(errors, moves, min(near, BLOCKED) if heaviest > HEAVY_LOAD else near, T_s, due, stall)
    if stall[STALL_SHARE] <= 1.0 - 1e-6:
        for a in range(n):
            slow = min(slower[a], SLOWEST)
            slower[a] = slow + max(stall[STALL_SHARE], LEAST_SHARE) * (slower[a] - slow)


slow_down = kernel(
    *(VECTOR, VECTOR, GIVEN_VECTOR, GIVEN_VECTOR, MATRIX, NUMBER, FLAG, NUMBER, NUMBER),
    *(VECTOR, VECTOR, VECTOR, VECTOR, VECTOR, VECTOR),
)(plain(lower_velocities))
"""`lower_velocities` for callers in Python."""
