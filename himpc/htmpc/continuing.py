"""Continuation of a motion: the robot brakes to rest, or follows the shifted previous plan."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from himpc.htmpc.kernel.motion import brake
from himpc.htmpc.prediction import Motion, Start, velocities
from himpc.htmpc.settings import MotionBounds

Array = NDArray[np.float64]


def braking(start: Start, N: int, dt: float, period: float, bounds: MotionBounds) -> Array:
    """Returns inputs (N, n) that bring every joint to rest as fast as its bounds allow. A joint outside its
    range returns into it.

    A joint beyond a position bound moves back at up to a fifth of its speed limit. If input and jerk bounds
    contradict each other (after a limit was tightened), the jerk bound is satisfied.
    """
    U = np.empty((N, len(start.v)))
    brake(*start, dt, period, bounds.q_lower, bounds.q_upper, bounds.v, bounds.a, bounds.j, U)
    return U


def shifted(before: Motion, s: float, N: int, dt: float, bounds: MotionBounds) -> Array:
    """Returns the inputs (N, n) of the previous plan on a new grid of N intervals of dt, which begins s
    seconds after the start of that plan.

    Each input is the mean of the old input over the new interval. Therefore the velocities at the new knots
    are those of the old plan at the same times, for every control rate, also after a change of N or dt.
    After its end the old plan is continued by braking. If it were continued at constant velocity, hard limits
    would become infeasible.
    """
    reach = s + N * dt
    length = len(before.U) * before.dt
    missing = max(0, math.ceil((reach - length) / before.dt - 1e-9))
    U = before.U
    if missing:
        end = Start(before.position(length), before.velocity(length), before.U[-1])
        U = np.vstack([U, braking(end, missing, before.dt, before.dt, bounds)])
    whole = round(s / dt)
    if dt == before.dt and abs(s - whole * dt) < 1e-12:
        return U[whole : whole + N].copy()
    V = np.vstack([before.start.v, velocities(before.start, U, before.dt)])
    old = before.dt * np.arange(len(V))
    new = s + dt * np.arange(N + 1)
    sampled = np.array([np.interp(new, old, column) for column in V.T]).T
    return np.diff(sampled, axis=0) / dt
