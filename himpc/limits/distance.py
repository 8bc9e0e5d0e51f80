"""Distances between links, and between links and objects: the speed of approach from which a robot can still
stop."""

from __future__ import annotations

import numpy as np

from himpc.constants import FADE, RETREAT, RETURN_RATE, WITHIN
from himpc.limits.constraint import Block, Constraint, Directions, Moment, Near
from himpc.limits.limits import MOST, Avoidance
from himpc.limits.velocity import approached, summed_twice
from robots.arrays import Array


def row_count(n: int) -> int:
    """Returns the largest number of pairs with a row, for n joints."""
    return min(n, MOST)


def least_rates(near: Near, avoidance: Avoidance) -> Array:
    """Returns the least ∇d·q̇, (r,) m/s, from which d_safe can still be kept: −v_stop(d − d_safe), with the
    margin added to d_safe. Within the margin, d must not decrease. Below d_safe, d must increase. The
    velocity of an object is taken into account."""
    t, a = avoidance.reaction, avoidance.deceleration
    d_safe = near.share * avoidance.d_safe
    room = near.distance - d_safe - near.share * avoidance.margin
    stop = a * (np.sqrt(t**2 + 2.0 / a * np.maximum(room, 0.0)) - t)
    back = np.maximum(RETURN_RATE * np.minimum(near.distance - d_safe, 0.0), -RETREAT)
    with np.errstate(divide="ignore"):
        fade = np.clip((WITHIN - near.distance) / FADE, 0.0, 1.0)
        return np.where(room > 0.0, -stop / fade, -back) + near.moving


def _bounds(now: Moment) -> Block:
    state, N, T_s, n = now.state, now.N, now.T_s, now.state.q.size
    lower, upper, D = np.full((N, n), -np.inf), np.full((N, n), np.inf), np.zeros((n, n))
    names = [""] * n
    if now.near is not None:
        # ∇d·q̇ at knot j+1 is ∇d·(q̇_k + gained_j) + T_s D·(L U)_j with D = M̄⁻¹∇d.
        gained = state.gained_velocity(N, T_s)
        share = approached(N, now.limits.velocity_approach * T_s)[:, 0]
        rates = least_rates(near := now.near, now.limits.avoidance)
        for c, gradient in enumerate(near.gradient[: row_count(n)]):
            along = gradient / now.M_bar
            length = float(np.linalg.norm(along))
            if length == 0.0 or not np.isfinite(rates[c]):
                continue
            D[c], names[c] = along / length, near.names[c]
            lower[:, c] = (share * (rates[c] - gradient @ state.v) - gained @ gradient) / (T_s * length)
    return Block(lower, upper, Directions(D, tuple(names)))


DISTANCE = Constraint(
    "distance",
    summed_twice,
    first_knot=1,
    hard=False,
    is_on=lambda limits: limits.avoidance.on,
    bounds=_bounds,
    yields_first=True,
)
