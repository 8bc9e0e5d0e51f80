"""Fallbacks for a level without an optimum: softened bounds, and increments that satisfy the bounds."""

from __future__ import annotations

import numpy as np

from himpc.cascade.level import Fallback
from himpc.limits.rest import braking, least_slack, missed
from himpc.limits.rows import Rows
from robots.arrays import Array

ROOM = 1e-7
"""N·m added to the least slack, so that the widened rows have an interior in spite of rounding."""


def softened(rows: Rows) -> Rows | None:
    """Returns the rows widened by the least slack that makes them feasible; None if they need no slack."""
    slack = least_slack(rows)
    return rows.widened(np.where(slack > 0, slack + ROOM, 0.0)) if slack.any() else None


def last_resort(rows: Rows, before: Array | None) -> tuple[Fallback, Array]:
    """Returns the last fallback. It is "previous", the shifted plan, if that plan satisfies all rows.
    Otherwise it is "brake": increments that bring the joints to rest, and satisfy all rows if this is
    possible.

    Args:
        rows: all bounds.
        before: the level's increments at the previous tick if they were an optimum, otherwise None.

    Returns:
        the name of the fallback and the increments, (N, n) N·m.
    """
    shape = rows.L.shape[1], rows.lower.shape[1]
    if before is not None and before.shape == shape:
        shifted = np.vstack([before[1:], np.zeros((1, shape[1]))])
        if np.isfinite(shifted).all() and not missed(rows, shifted).any():
            return "previous", shifted
    return "brake", braking(rows)


def towards(rows: Rows, U: Array, wanted: Array) -> Array | None:
    """Moves from U, which satisfies the rows, towards `wanted` as far as the rows allow, (N, n) each; None if
    no step is possible."""
    if not np.isfinite(wanted).all():
        return None
    here, change = rows.values(U), rows.values(wanted - U)
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(change > 0, rows.upper - here, here - rows.lower) / np.abs(change)
    share = min(1.0, float(np.min(room, where=change != 0, initial=1.0)))
    return U + share * (wanted - U) if share > 0 else None


def containing(rows: Rows, U: Array) -> Rows:
    """Returns the rows, widened until U satisfies them. Lower levels then start from the feasible point U."""
    value = rows.values(U)
    return rows._replace(lower=np.minimum(rows.lower, value), upper=np.maximum(rows.upper, value))
