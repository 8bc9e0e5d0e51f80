"""Safety checks: whether a measured state can be used, and which commands may be sent."""

from __future__ import annotations

import numpy as np

from himpc.htmpc.prediction import Start
from himpc.htmpc.settings import MotionBounds
from robots import Robot
from robots.arrays import Array
from robots.per_robot import per_robot

_FASTEST = 20.0
"""A joint speed above this multiple of the robot's limit is a measurement error."""
_OUTSIDE = 10.0
"""A joint position that is farther outside its range than this, rad or m, is a measurement error."""
_FARTHEST = 1e6
"""The largest distance from zero, rad or m, of a valid position of a joint without a range."""


def plausible(robot: Robot, q: Array, v: Array) -> bool:
    """Returns whether a measured state is a valid start of a plan: finite, and near the ranges of positions
    and velocities.

    Args:
        robot: its limits define these ranges.
        q, v: measured joint positions and velocities, (n,).
    """
    lower, upper, fastest = _believable(robot)
    # A comparison with NaN is false, so that a value that is not finite is not plausible either.
    return bool(((q >= lower) & (q <= upper) & (np.abs(v) <= fastest)).all())


@per_robot
def _believable(robot: Robot) -> tuple[Array, Array, Array]:
    """Returns the least and greatest positions and the greatest speeds that a valid measurement may have,
    (n,) each."""
    lower = np.where(np.isfinite(robot.q_lower), robot.q_lower - _OUTSIDE, -_FARTHEST)
    upper = np.where(np.isfinite(robot.q_upper), robot.q_upper + _OUTSIDE, _FARTHEST)
    return lower, upper, np.where(np.isfinite(robot.v_limit), _FASTEST * robot.v_limit, _FARTHEST)


def commandable(v: Array, last: Array | None, bounds: MotionBounds) -> Array:
    """Returns the measured velocity (n,), clipped to the velocities that may be commanded.

    The commands of a plan begin at this velocity. A robot that was pushed beyond its limit must not receive
    its measured velocity as a command.

    Args:
        v: measured velocity, (n,).
        last: the last commanded velocity, None if there is none. It may exceed bounds that were tightened
            later; the robot then brakes from this velocity.
        bounds: the bounds that apply now.
    """
    most = bounds.v if last is None else np.maximum(bounds.v, np.abs(last))
    return np.minimum(np.maximum(v, -most), most)


def permitted(start: Start, U: Array, bounds: MotionBounds, period: float) -> Array:
    """Returns the inputs (N, n). The first input is changed such that the commands of this period satisfy the
    bounds.

    If the QP's rows were hard and feasible, the commands already satisfy the bounds. If the speed exceeds a
    bound that was tightened, the robot may brake as slowly as its jerk bound requires, but its speed does not
    increase.

    Args:
        start: the initial state of the plan.
        U: finite inputs, (N, n).
        bounds: the bounds that apply now.
        period: the time in s for which the first input is commanded.
    """
    fastest = np.maximum(bounds.v, np.abs(start.v))
    first = np.minimum(np.maximum(U[0], (-fastest - start.v) / period), (fastest - start.v) / period)
    # If a tightened acceleration bound is below the present input, the input reaches it within the jerk
    # bound.
    most = np.maximum(bounds.a, np.abs(start.u) - bounds.j * period)
    U = U.copy()
    U[0] = np.minimum(np.maximum(first, -most), most)
    return U
