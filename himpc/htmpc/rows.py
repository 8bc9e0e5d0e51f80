"""The linear rows of (7d): velocity, position, input and jerk bounds on the condensed inputs.

All rows read lower ≤ A u ≤ upper with u the inputs, knot by knot, (N·n,). Two groups see past the horizon, so
that the next step's problem has a solution too: "ramp" rows leave room to take the input back to zero within
the jerk bound, "stop" rows room to stop before a position bound.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.htmpc.prediction import Start, integrator
from himpc.htmpc.settings import Bounds

Array = NDArray[np.float64]
KINDS = ("velocity", "position", "acceleration", "jerk", "ramp", "stop", "lexicographic", "collision")

_STOP_STEPS = 40
"""Braking is watched for at most this many knots beyond the horizon."""


class Rows(NamedTuple):
    """Rows with labels.

    Attributes:
        A: (r, N·n); lower, upper: (r,).
        kind: (r,) index into KINDS; knot: (r,) 1 … N (0 … N−1 for inputs); part: (r,) joint or coordinate.
    """

    A: Array
    lower: Array
    upper: Array
    kind: NDArray[np.int64]
    knot: NDArray[np.int64]
    part: NDArray[np.int64]

    def take(self, chosen: NDArray[np.bool_]) -> Rows:
        """The chosen rows."""
        A, lower, upper, kind, knot, part = self
        return Rows(A[chosen], lower[chosen], upper[chosen], kind[chosen], knot[chosen], part[chosen])

    def about(self, u: Array) -> Rows:
        """The same rows for the change d of u, u + d."""
        value = self.A @ u
        return self._replace(lower=self.lower - value, upper=self.upper - value)

    def widened(self, u: Array) -> Rows:
        """Bounds moved out just far enough to contain u."""
        value = self.A @ u
        return self._replace(lower=np.minimum(self.lower, value), upper=np.maximum(self.upper, value))

    def violation(self, u: Array) -> float:
        """By how much u leaves the bounds, largest row."""
        value = self.A @ u
        excess = np.maximum(self.lower - value, value - self.upper)
        return max(0.0, float(excess.max(initial=0.0)))


def joined(*parts: Rows) -> Rows:
    """All rows of several groups."""
    return Rows(
        np.concatenate([rows.A for rows in parts]),
        np.concatenate([rows.lower for rows in parts]),
        np.concatenate([rows.upper for rows in parts]),
        np.concatenate([rows.kind for rows in parts]),
        np.concatenate([rows.knot for rows in parts]),
        np.concatenate([rows.part for rows in parts]),
    )


class _Frame(NamedTuple):
    """The part of the rows that depends on (N, Δt, n) only: A, and the labels."""

    A: Array
    kind: NDArray[np.int64]
    knot: NDArray[np.int64]
    part: NDArray[np.int64]


@lru_cache(maxsize=16)
def _frame(N: int, dt: float, n: int) -> _Frame:
    matrices = integrator(N, dt)
    eye = np.eye(n)
    blocks = [np.kron(each, eye) for each in (matrices.T_v, matrices.T_q, np.eye(N), matrices.D)]
    knots = np.repeat(np.arange(N), n)
    return _Frame(
        np.asarray(np.vstack(blocks), np.float64),
        np.repeat(np.arange(4), N * n),
        np.concatenate([knots + 1, knots + 1, knots, knots]),
        np.tile(np.arange(n), 4 * N),
    )


def limit_rows(start: Start, N: int, dt: float, period: float, bounds: Bounds) -> Rows:
    """All rows that bounds of this tick can make binding.

    A row is left out when no inputs inside the input bounds can reach its bound.
    """
    n = len(start.v)
    frame, matrices = _frame(N, dt, n), integrator(N, dt)
    drift = (start.q + matrices.t[:, None] * start.v).ravel()
    resting = np.tile(start.v, N)
    a, v, tile = np.tile(bounds.a, N), np.tile(bounds.v, N), np.tile
    change = np.vstack([bounds.j * min(period, dt), np.tile(bounds.j * dt, (N - 1, 1))]).ravel()
    before = np.zeros((N, n))
    before[0] = start.u
    before = before.ravel()
    lower = np.concatenate([-v - resting, tile(bounds.q_lower, N) - drift, -a, before - change])
    upper = np.concatenate([v - resting, tile(bounds.q_upper, N) - drift, a, before + change])
    reach = np.concatenate(
        [
            np.repeat(matrices.t, n) * a,
            0.5 * np.repeat(matrices.t, n) ** 2 * a,
            np.full(N * n, np.inf),
            np.concatenate([bounds.a + np.abs(start.u), 2.0 * a[n:]]),
        ]
    )
    bounded = np.isfinite(lower) | np.isfinite(upper)
    near = bounded & ((upper < reach) | (lower > -reach))
    limits = Rows(
        frame.A[near], lower[near], upper[near], frame.kind[near], frame.knot[near], frame.part[near]
    )
    tails = [each for each in (_ramp(start, N, dt, bounds), _stop(start, N, dt, bounds)) if each is not None]
    return joined(limits, *tails) if tails else limits


def _ramp(start: Start, N: int, dt: float, bounds: Bounds) -> Rows | None:
    """|v_N ± Δt (m u_{N−1} − j Δt m(m+1)/2)| ≤ v_max: speed while the input goes back to zero, m steps on."""
    n, step = len(start.v), bounds.j * dt
    T_v = integrator(N, dt).T_v[-1]
    coefficients: list[tuple[int, int]] = [
        (joint, m)
        for joint in np.flatnonzero(np.isfinite(step) & np.isfinite(bounds.v) & (bounds.a > step)).tolist()
        for m in range(1, min(math.ceil(bounds.a[joint] / step[joint]), 10) + 1)
    ]
    if not coefficients:
        return None
    A = np.zeros((len(coefficients), N, n))
    room = np.empty(len(coefficients))
    for row, (joint, m) in enumerate(coefficients):
        A[row, :, joint] = T_v
        A[row, -1, joint] += m * dt
        room[row] = bounds.v[joint] + dt * step[joint] * m * (m + 1) / 2
    joints = np.array([joint for joint, _ in coefficients])
    return _labelled(A, -room - start.v[joints], room - start.v[joints], 4, N, joints)


def _stop(start: Start, N: int, dt: float, bounds: Bounds) -> Rows | None:
    """q_N + mΔt v_N ∓ ½a(mΔt)² inside the range: where full braking for m steps leads."""
    n = len(start.v)
    matrices = integrator(N, dt)
    T, a = float(matrices.t[-1]), bounds.a
    usable = np.isfinite(a) & (np.isfinite(bounds.q_lower) | np.isfinite(bounds.q_upper))
    fastest = np.minimum(bounds.v, np.abs(start.v) + a * T)
    steps = dt * np.arange(1, _STOP_STEPS + 1)
    with np.errstate(invalid="ignore"):
        # Where q gets at most in m steps of braking, from the fastest motion that the input bounds permit.
        far = 0.5 * a * T**2 + steps[:, None] * fastest - 0.5 * a * steps[:, None] ** 2
        moving = steps[:, None] < fastest / a + dt
    ahead = start.q + T * start.v
    near = (ahead + far > bounds.q_upper) | (ahead - far < bounds.q_lower)
    m, joints = np.nonzero(near & moving & usable)
    if not m.size:
        return None
    A = np.zeros((m.size, N, n))
    A[np.arange(m.size), :, joints] = matrices.T_q[-1] + steps[m, None] * matrices.T_v[-1]
    brake = 0.5 * a[joints] * steps[m] ** 2
    coasting = ahead[joints] + steps[m] * start.v[joints]
    lower, upper = bounds.q_lower[joints] - brake, bounds.q_upper[joints] + brake
    return _labelled(A, lower - coasting, upper - coasting, 5, N, joints)


def _labelled(A: Array, lower: Array, upper: Array, kind: int, N: int, joints: NDArray[np.int64]) -> Rows:
    rows = len(A)
    return Rows(A.reshape(rows, -1), lower, upper, np.full(rows, kind), np.full(rows, N), joints)


def held(rows: Rows, brake: Array, joints: NDArray[np.int64]) -> Rows:
    """Rows that keep some joints on their way to rest: their inputs are those of `brake` (N, n)."""
    N, n = brake.shape
    chosen = (np.arange(N)[:, None] * n + joints).ravel()
    value = brake.ravel()[chosen]
    fixed = Rows(
        np.eye(N * n)[chosen],
        value,
        value,
        np.full(len(chosen), 2),
        np.repeat(np.arange(N), len(joints)),
        np.tile(joints, N),
    )
    return joined(rows.take(~np.isin(rows.part, joints)), fixed)
