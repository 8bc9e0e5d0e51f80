"""Slows the joints down while a robot is at the bound of a distance and its tasks make no progress."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.constants import (
    BLOCKED,
    CLOSE_ENOUGH,
    DISTURBED,
    INSIDE,
    LEAST_SHARE,
    PROGRESS,
    PROGRESS_SHARE,
    RECOVERY,
    REST,
    SLOWEST,
    SLOWING,
    STALLED,
)
from himpc.limits.limits import LimitsInForce

Array = NDArray[np.float64]


class Stall(NamedTuple):
    """The degree to which a robot is stalled.

    Attributes:
        share: 1 if it is not stalled, 0 if it is completely stalled.
        due: (T,) the errors, m or rad, that the tasks should have reached by now.
        least: the smallest error of the first task after the robot was last free to move.
    """

    share: float
    due: Array
    least: float


def going(tasks: int) -> Stall:
    """Returns the state of a robot that is not stalled."""
    return Stall(1.0, np.full(tasks, np.inf), np.inf)


def stalled(before: Stall, errors: Array, moves: bool, room: float, T_s: float) -> Stall:
    """Returns the stall one period later.

    Without this function, an arm that is dragged into the floor stops above the floor, but its joints
    continue to move near their limits. The joints become slower while an obstacle is near, no reference
    moves, and no task that is away from its target makes progress. A robot that has become slow stays slow
    until a reference moves, no obstacle is near, or its first task is disturbed.

    Args:
        before: the stall one period ago.
        errors: the length of each task's error, (T,) m or rad.
        moves: whether a reference or the obstacle moves.
        room: the amount by which the nearest distance exceeds d_safe, m; infinite without a near pair.
        T_s: control period, s.
    """
    far, first = errors > CLOSE_ENOUGH, float(errors[0])
    free = moves or not INSIDE <= room <= BLOCKED or not far.any()
    brakes, rests = REST < before.share < STALLED, before.share <= REST
    if free or (first > before.least + DISTURBED and not brakes):
        due, least, slows = errors, first, False
    else:
        decrease = (PROGRESS + PROGRESS_SHARE * errors) * T_s
        due = np.minimum(errors, before.due - decrease)
        least = first if brakes else min(first, before.least)
        slows = brakes or rests or not bool((far & (errors <= due + CLOSE_ENOUGH)).any())
    goal, seconds = (0.0, SLOWING) if slows else (1.0, RECOVERY)
    return Stall(before.share + min(1.0, T_s / seconds) * (goal - before.share), due, least)


def slowed(limits: LimitsInForce, stall: Stall) -> LimitsInForce:
    """Returns the limits in force, with the lower velocity limits of a stalled robot."""
    if stall.share > 1.0 - 1e-6:
        return limits
    slow = np.minimum(limits.v_limit, SLOWEST)
    return limits.with_velocities(slow + max(stall.share, LEAST_SHARE) * (limits.v_limit - slow))
