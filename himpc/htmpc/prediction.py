"""The condensed double integrator (4) with G = I: computes velocities and positions at the knots from the
inputs, and continues a motion to rest or along the previous plan.

The input is constant between knots, so the prediction is exact:
v_k = v_0 + Δt Σ_{s<k} u_s and q_k = q_0 + kΔt v_0 + Δt² Σ_{s<k} (k − s − ½) u_s.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from himpc.htmpc.kernel.motion import brake
from himpc.htmpc.settings import MotionBounds
from robots.arrays import Array


class Integrator(NamedTuple):
    """Matrices of the double integrator for one pair (N, Δt); they are the same for every joint.

    Attributes:
        T_v: (N, N), velocities at knots 1 … N from the inputs.
        T_q: (N, N), positions at knots 1 … N from the inputs.
        D: (N, N), Δu from the inputs; the term −u_{−1} of the first row is not included.
        t: (N,) s, times of knots 1 … N.
    """

    T_v: Array
    T_q: Array
    D: Array
    t: Array


@lru_cache(maxsize=32)
def integrator(N: int, dt: float) -> Integrator:
    """Returns the condensed double integrator of N steps of dt seconds."""
    k, s = np.arange(1, N + 1)[:, None], np.arange(N)[None, :]
    before = s < k
    T_v = np.where(before, dt, 0.0)
    T_q = np.where(before, dt * dt * (k - s - 0.5), 0.0)
    matrices = Integrator(
        T_v, T_q, np.eye(N) - np.eye(N, k=-1), np.asarray(dt * np.arange(1, N + 1), np.float64)
    )
    for matrix in matrices:
        matrix.setflags(write=False)
    return matrices


class Start(NamedTuple):
    """The initial state of a prediction: q_0, v_0 and the input that acted before, (n,) each."""

    q: Array
    v: Array
    u: Array


def velocities(start: Start, U: Array, dt: float) -> Array:
    """Returns v at knots 1 … N, (N, n), for inputs U (N, n)."""
    return start.v + integrator(len(U), dt).T_v @ U


def positions(start: Start, U: Array, dt: float) -> Array:
    """Returns q at knots 1 … N, (N, n), for inputs U (N, n)."""
    return coasting(start, len(U), dt) + integrator(len(U), dt).T_q @ U


def coasting(start: Start, N: int, dt: float) -> Array:
    """Returns q at knots 1 … N without inputs, (N, n)."""
    return start.q + integrator(N, dt).t[:, None] * start.v


class Motion(NamedTuple):
    """A plan as a function of time. Knots are dt apart; velocities are linear between them.

    Attributes:
        start: its first knot.
        U: (N, n) inputs.
        dt: s.
    """

    start: Start
    U: Array
    dt: float

    def velocity(self, s: float) -> Array:
        """Returns v at s ≥ 0 seconds after the start, (n,); it is constant after the last knot."""
        k = min(math.floor(s / self.dt + 1e-9), len(self.U))
        v = self.start.v + self.dt * self.U[:k].sum(axis=0)
        return v + (s - k * self.dt) * self.U[k] if k < len(self.U) else v

    def position(self, s: float) -> Array:
        """Returns q at 0 ≤ s ≤ N·dt seconds after the start, (n,)."""
        whole = min(math.floor(s / self.dt + 1e-9), len(self.U))
        rest = s - whole * self.dt
        q = self.start.q + whole * self.dt * self.start.v
        q = q + self.dt**2 * ((whole - np.arange(whole) - 0.5) @ self.U[:whole])
        if rest == 0.0:
            return q
        v = self.velocity(whole * self.dt)
        u = self.U[whole] if whole < len(self.U) else np.zeros_like(v)
        return q + rest * v + 0.5 * rest * rest * u


def underway(past: Sequence[Motion], period: float, delay: float) -> Array:
    """Returns ∫ v ds, (n,), over the last `delay` seconds of commands. Each plan was followed for one period.

    Before the first stored plan the robot is assumed to have moved with that plan's initial velocity.
    """
    total = np.zeros_like(past[-1].start.q)
    left = delay
    for motion in reversed(past):
        if left <= 0.0:
            return total
        part = min(left, period)
        total += motion.position(period) - motion.position(period - part)
        left -= part
    return total + max(left, 0.0) * past[0].start.v


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
