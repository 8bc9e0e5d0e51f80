"""Checks the return value of a user's controller, and computes its effect on the levels."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import NO_ROWS, Fallback, LevelSolution
from himpc.controllers.view import LevelView
from himpc.formulation.forms import usable
from himpc.limits import TORQUE, Rows

Array = NDArray[np.float64]


class OwnFault(Exception):
    """A user's controller failed or returned an invalid value. The message is one sentence."""


def checked(answer: Any, levels: int, n: int, where: str) -> Array:
    """Returns the torques as an array (1, n), or (r, n) with one row per level. Raises OwnFault for any other
    value."""
    what = f"a torque has shape ({n},)" + (f", or ({levels}, {n}) with a row per level" if levels > 1 else "")
    try:
        torques = np.array(answer if answer is not None else "", float)
    except (TypeError, ValueError):
        raise OwnFault(f"{where}: it returned {_short(answer)} where numbers are needed: {what}") from None
    if torques.shape == (n,):
        torques = torques[None]
    if torques.shape not in ((1, n), (levels, n)):
        raise OwnFault(f"{where}: it returned an array of shape {torques.shape}: {what}")
    if not usable(torques.ravel()):
        worst = int(np.argmax(~np.isfinite(torques[-1]))) if not np.isfinite(torques[-1]).all() else None
        which = f" for joint {worst + 1}" if worst is not None else ""
        raise OwnFault(f"{where}: it returned a torque that is not finite, or is too large{which}")
    return torques


def next_cost(level: LevelView, effort: Array, T_s: float) -> float:
    """Returns ‖e_{k+1}‖²_Q of (28) at the first knot, for Δτ with M̄⁻¹Δτ = `effort`, (n,)."""
    x_ddot = level.x_ddot + level.J @ effort
    x_dot = level.x_dot + T_s * x_ddot
    error = level.error + T_s * level.x_dot - level.displacement_d[1]
    e = x_ddot - level.x_ddot_d[1] + level.K_v * (x_dot - level.x_dot_d[1]) + level.K_p * error
    return float(level.Q * e @ e)


def solution(
    name: str, U: Array, cost: float, leak: float, status: str = "own code", fallback: Fallback = "solve"
) -> LevelSolution:
    return LevelSolution(name, U[None], cost, NO_ROWS, math.nan, status, fallback, 0.0, 0.0, leak)


def no_rows(n: int) -> Rows:
    unbounded = np.full((1, n), np.inf)
    return Rows(np.ones((1, 1)), -unbounded, unbounded, (TORQUE,))


def _short(value: Any) -> str:
    return "nothing" if value is None else f"a {type(value).__name__}"
