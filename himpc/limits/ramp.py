"""Tightens limits gradually while the robot moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from himpc.limits.limits import LimitsInForce
from robots.arrays import Array

RAMP_SECONDS = 0.5


def ramp(
    now: LimitsInForce, goal: LimitsInForce, tau: Array, q: Array, v: Array, T_s: float
) -> LimitsInForce:
    """Moves the limits in force towards the desired limits by one control period.

    A loosened bound applies at once. A tightened bound first moves to the present value, which violates
    nothing. Then it moves to its goal with time constant RAMP_SECONDS, and at least at 20 % of the goal
    (positions: 0.2 rad) per second, so that it arrives.

    Args:
        now: limits in force up to now.
        goal: desired limits.
        tau: torque applied last, (n,) N·m.
        q, v: measured state, (n,).
        T_s: control period, s.
    """
    if now is goal:
        return goal
    closer = replace(
        goal,
        tau_upper=_close_in(now.tau_upper, goal.tau_upper, np.abs(tau), goal.tau_upper, T_s),
        tau_lower=-_close_in(-now.tau_lower, -goal.tau_lower, np.abs(tau), -goal.tau_lower, T_s),
        v_limit=_close_in(now.v_limit, goal.v_limit, np.abs(v), goal.v_limit, T_s),
        q_upper=_close_in(now.q_upper, goal.q_upper, q, np.ones_like(q), T_s),
        q_lower=-_close_in(-now.q_lower, -goal.q_lower, -q, np.ones_like(q), T_s),
    )
    fields = ("tau_lower", "tau_upper", "v_limit", "q_lower", "q_upper")
    return goal if all((getattr(closer, f) == getattr(goal, f)).all() for f in fields) else closer


def _close_in(now: Array, goal: Array, present: Array, size: Array, T_s: float) -> Array:
    start = np.minimum(now, np.maximum(present, goal))
    finite = np.isfinite(start) & np.isfinite(goal)
    distance = np.where(finite, start, 0.0) - np.where(finite, goal, 0.0)
    rate = np.maximum(distance, np.where(finite, 0.1 * size, 0.0)) / RAMP_SECONDS
    return np.where(finite, np.maximum(goal, start - rate * T_s), goal)
