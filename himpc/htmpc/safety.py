"""Safety checks for any measurement: which states can be used, and which commands may be sent."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from himpc.htmpc.prediction import Start
from himpc.htmpc.settings import MotionBounds
from robots import Robot
from robots.per_robot import per_robot

Array = NDArray[np.float64]

_FASTEST = 20.0
"""A joint speed above this multiple of the robot's limit is a measurement error."""
_OUTSIDE = 10.0
"""rad or m: a joint position farther outside its range is a measurement error."""
_FARTHEST = 1e6
"""rad or m: the same limit for a joint without a range, measured from zero."""


def plausible(robot: Robot, q: Array, v: Array) -> bool:
    """Whether a measured state is a valid start of a plan: finite, and neither absurdly far nor absurdly
    fast.

    Args:
        robot: its limits define what is absurd.
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

    The commands of a plan begin at this velocity: a robot that was pushed beyond its limit must not receive
    that velocity as a command.

    Args:
        v: measured, (n,).
        last: the velocity commanded last, None if there is none. It may exceed bounds that were tightened
            since: from there the robot brakes.
        bounds: in force.
    """
    most = bounds.v if last is None else np.maximum(bounds.v, np.abs(last))
    return np.minimum(np.maximum(v, -most), most)


def permitted(start: Start, U: Array, bounds: MotionBounds, period: float) -> Array:
    """Returns the inputs (N, n) with the first one changed such that the commands of this period keep their
    bounds.

    They already keep them if the QP's rows were hard and feasible. From a speed above its bound (which was
    tightened) the robot may brake as slowly as its jerk bound requires, but it does not become faster.

    Args:
        start: where the plan begins.
        U: finite inputs, (N, n).
        bounds: in force.
        period: s, how long the first input is commanded.
    """
    fastest = np.maximum(bounds.v, np.abs(start.v))
    first = np.minimum(np.maximum(U[0], (-fastest - start.v) / period), (fastest - start.v) / period)
    # An acceleration bound below the present input (it was tightened) is reached within the jerk bound.
    most = np.maximum(bounds.a, np.abs(start.u) - bounds.j * period)
    U = U.copy()
    U[0] = np.minimum(np.maximum(first, -most), most)
    return U
