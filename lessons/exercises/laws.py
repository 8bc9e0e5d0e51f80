"""The control laws of the exercises, with an argument for each known mistake. The grader recognises mistakes
by these laws.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from himpc.controllers.view import LevelView, View
from himpc.qp import solve_qp
from lessons.exercises.starts.two_levels import bounds

Array = NDArray[Any]


def wanted(level: LevelView, *, K_p: float = 1.0, K_v: float = 1.0, target: bool = True) -> Array:
    """Returns ẍ of the target motion (4), (m,). K_p, K_v: factors on the gains. target: whether the error is
    x − x_d instead of x."""
    error = level.error if target else next(iter(level.x.values()))
    velocity = level.x_dot - level.x_dot_d[0]
    return level.x_ddot_d[0] - K_v * level.K_v * velocity - K_p * level.K_p * error


def held(now: View) -> Array:
    """Returns the acting torque unchanged."""
    return now.tau_0


def osf(
    now: View,
    *,
    K_p: float = 1.0,
    K_v: float = 1.0,
    curvature: float = 1.0,
    projector: str = "consistent",
    twice: bool = False,
    order: int = 1,
    levels: int = 2,
    bias: bool = True,
) -> Array:
    """Returns the torque of operational-space control. The arguments are factors on terms, or switch terms
    off."""
    M_inv = np.linalg.inv(now.M)
    N, tau = np.eye(now.n), np.zeros(now.n)
    for level in now.levels[::order][:levels]:
        J = level.J @ N
        L = np.linalg.pinv(J @ M_inv @ J.T, rcond=1e-9, hermitian=True)
        above = 0.0 if twice else level.J @ M_inv @ tau
        tau = tau + J.T @ L @ (wanted(level, K_p=K_p, K_v=K_v) - curvature * level.J_dot_q_dot - above)
        used: Any = {
            "consistent": lambda M_inv=M_inv, J=J, L=L: M_inv @ J.T @ L @ J,
            "transposed": lambda M_inv=M_inv, J=J, L=L: J.T @ L @ J @ M_inv,
            "plain": lambda J=J: np.linalg.pinv(J) @ J,
            "none": lambda: np.zeros((now.n, now.n)),
        }[projector]()
        N = N - used
    return tau + (now.bias if bias else 0.0)


def hierarchy(
    now: View,
    *,
    levels: int = 2,
    order: int = 1,
    ahead: int = 1,
    Q: bool = True,
    R: bool = True,
    M_bar: bool = True,
    f: float = 1.0,
    limits: str = "all",
    equality: str = "(33)",
    alone: bool = False,
) -> Array:
    """Returns the torque of one or two levels of the QP (35), one knot. The arguments are factors on terms,
    or switch terms off."""
    chosen = now.levels[::order][:levels]
    first: Array | None = None
    tau = now.tau_0
    for level in chosen:
        H, linear = _quadratic(now, level, ahead, Q, R, M_bar)
        rows, lower, upper = _bounds(now, limits)
        if first is not None and equality != "none":
            above = now.levels[0] if equality == "about the first" else chosen[0]
            B = above.J if equality == "without M̄" else above.J / now.M_bar
            kept = rows @ first
            lower, upper = np.minimum(lower, kept), np.maximum(upper, kept)
            value = 0.0 * (B @ first) if equality == "zero" else B @ first
            rows, lower, upper = np.vstack([rows, B]), np.r_[lower, value], np.r_[upper, value]
        if limits == "afterwards":
            step = np.clip(np.linalg.solve(H, -f * linear), lower[: now.n], upper[: now.n])
        else:
            step = solve_qp(H, f * linear, rows, lower, upper).x
        first = step if first is None else first
        tau = step if alone else now.tau_0 + step
    return tau


def _quadratic(now: View, level: LevelView, ahead: int, Q: bool, R: bool, M_bar: bool) -> tuple[Array, Array]:
    T = now.T_s
    G = (1.0 + level.K_v * T)[:, None] * (level.J / now.M_bar if M_bar else level.J)
    e = (
        level.x_ddot
        - level.x_ddot_d[ahead]
        + level.K_v * (level.x_dot + T * level.x_ddot - level.x_dot_d[ahead])
        + level.K_p * (level.error + T * level.x_dot - level.displacement_d[ahead])
    )
    weighted = G.T @ (level.Q[:, None] * G)
    return weighted + (np.diag(level.R) if R else 1e-9 * np.eye(now.n)), G.T @ ((level.Q if Q else 1.0) * e)


def _bounds(now: View, limits: str) -> tuple[Array, Array, Array]:
    shown: Any = now
    rows, lower, upper = bounds(shown)
    n = now.n
    if limits == "none":
        lower, upper = lower - 1e6, upper + 1e6
    elif limits == "torque":
        lower, upper = np.r_[lower[:n], -1e9 * np.ones(n)], np.r_[upper[:n], 1e9 * np.ones(n)]
    elif limits == "on the increment":
        lower, upper = np.r_[now.bounds.tau_lower, lower[n:]], np.r_[now.bounds.tau_upper, upper[n:]]
    elif limits == "at once":
        T, room = now.T_s, now.bounds
        scale = now.M_bar / T
        low = ((room.v_lower - now.q_dot) - T * now.q_ddot) * scale
        high = ((room.v_upper - now.q_dot) - T * now.q_ddot) * scale
        lower, upper = np.r_[lower[:n], low], np.r_[upper[:n], high]
    return rows, lower, upper
