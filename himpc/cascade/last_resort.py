"""What is left where a level has no optimum: bounds that give way, and increments that keep to the torque."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import Rung
from himpc.limits.rows import Rows, least_slack

Array = NDArray[np.float64]

_ROOM = 1e-7
"""N·m added to the least slack, so that the widened rows have an interior to rounding."""


def softened(rows: Rows) -> Rows | None:
    """The rows with the least slack that makes them feasible; None if they need none."""
    slack = least_slack(rows)
    return rows.widened(np.where(slack > 0, slack + _ROOM, 0.0)) if slack.any() else None


def last_resort(
    rows: Rows, before: Array | None, damped: Callable[[Rows], Array | None]
) -> tuple[Rung, Array]:
    """The last rungs: the shifted "previous" plan if it meets the torque rows, the "damping" level alone
    under torque rows, or "hold", the torque as it is.

    Args:
        rows: all bounds.
        before: the level's increments a tick ago, if there are any.
        damped: the increments of the damping level alone under torque rows, None if they are not found.

    Returns:
        the rung and the increments, (N, n) N·m.
    """
    torque, shape = rows.torque_only(), (rows.L.shape[1], rows.lower.shape[1])
    if before is not None and before.shape == shape:
        shifted = np.vstack([before[1:], np.zeros((1, shape[1]))])
        value = torque.L @ shifted
        if ((value >= torque.lower) & (value <= torque.upper)).all():
            return "previous", shifted
    U = damped(torque)
    if U is not None:
        return "damping", U
    held = np.zeros(shape)
    held[0] = np.clip(held[0], torque.lower[0], torque.upper[0])
    return "hold", held


def containing(rows: Rows, U: Array) -> Rows:
    """The rows widened as far as U needs: lower levels then start from a feasible point."""
    value = rows.L @ U
    return rows._replace(lower=np.minimum(rows.lower, value), upper=np.maximum(rows.upper, value))
