"""The control laws of the exercises, with an argument for each known mistake. The grader recognises mistakes
by these laws. The arguments are factors on terms, or switch terms off.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from himpc.controllers.view import LevelView, View
from himpc.qp import solve_qp
from lessons.exercises.mistakes import Law
from lessons.exercises.starts.distance_row import cascade
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


def joint_pd(now: View, *, gravity: float = 1.0, M_bar: bool = True, **how: Any) -> Array:
    """Returns the torque of PD control with gravity compensation, for a level of joints."""
    effort = wanted(now.levels[0], **how)
    return gravity * now.gravity + (now.M_bar * effort if M_bar else effort)


def _frozen_gravity() -> Law:
    """Returns `joint_pd` with the gravity torques of its first tick."""
    first: list[Any] = []

    def law(now: View) -> Any:
        first.append(now.gravity)
        return joint_pd(now) - now.gravity + first[0]

    return law


def time_delay(now: View, *, tau: str = "τ₀", a: float = 1.0, M_bar: bool = True, **how: Any) -> Array:
    """Returns the torque of time-delay estimation, for a level of joints."""
    effort = wanted(now.levels[0], **how) - a * now.q_ddot
    before = {"τ₀": now.tau_0, "g": now.gravity, "both": now.tau_0 + now.gravity, "none": 0.0}[tau]
    return before + (now.M_bar * effort if M_bar else effort)


def _late(now: View) -> Array:
    """Returns the torque of `time_delay` with a difference of velocities that is not divided by T_s."""
    return time_delay(now, a=now.T_s)


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
    """Returns the torque of operational-space control."""
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
    """Returns the torque of one or two levels of the QP (35), one knot."""
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


def _distance_rows(
    now: View,
    *,
    D: float = 1.0,
    gradient: float = 1.0,
    M_bar: bool = True,
    T_s: bool = True,
    d_safe: float = 1.0,
    v_stop: str = "viable",
    speed: float = 1.0,
    q_ddot: float = 1.0,
    at_once: bool = False,
    pairs: str = "all",
) -> tuple[Array, Array]:
    """Returns the rows D and their lower bounds, with which distances are kept."""
    near, T = now.near, now.T_s
    slopes = gradient * near.gradient
    free = near.d - d_safe * near.d_safe
    room = np.maximum(free, 0.0)
    t, a = near.reaction, near.deceleration
    stop = {
        "viable": a * (np.sqrt(t**2 + 2.0 * room / a) - t),
        "no reaction": np.sqrt(2.0 * a * room),
        "upwards": -a * (np.sqrt(t**2 + 2.0 * room / a) - t),
        "none": 0.0 * room,
        "linear": room / t,
        "signed": a * (np.sqrt(np.maximum(t**2 + 2.0 * free / a, 0.0)) - t),
    }[v_stop]
    share = 1.0 if at_once else min(1.0, now.bounds.approach * T or 1.0)
    lower = share * (-stop - speed * slopes @ now.q_dot) - q_ddot * T * slopes @ now.q_ddot
    rows = D * (T if T_s else 1.0) * (slopes / now.M_bar if M_bar else slopes)
    chosen = {
        "all": slice(None),
        "nearest": slice(1),
        "touching": near.d <= near.d_safe,
        "none": slice(0),
    }[pairs]
    return rows[chosen], lower[chosen]


def distance_row(now: View, **how: Any) -> Any:
    """Returns the torques of all levels of the QP (35), one knot, below the rows that keep distances."""
    return cascade(now, *_distance_rows(now, **how))


LAWS: Mapping[str, Callable[..., Law]] = {
    "joint-pd": partial(partial, joint_pd),
    "null-space": partial(partial, osf),
    "time-delay": partial(partial, time_delay),
    "one-level-qp": partial(partial, hierarchy, levels=1),
    "two-levels": partial(partial, hierarchy),
    "distance-row": partial(partial, distance_row),
    "held": partial(partial, held),
    "frozen gravity": _frozen_gravity,
    "late": partial(partial, _late),
}
"""Functions that return a law without memory of earlier runs: that of an exercise with some arguments, or a
further mistake."""
