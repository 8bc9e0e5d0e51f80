"""The bounds (32d)–(32f) over the horizon as rows on the increments."""

from __future__ import annotations

from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.limits.limits import Limits, LimitsInForce
from himpc.limits.viability import viability_bounds
from himpc.prediction.joint import JointState

Array = NDArray[np.float64]
Kind = Literal["torque", "velocity", "position"]


class Rows(NamedTuple):
    """lower ≤ L U ≤ upper, U = (N, n) increments; every joint has the same L.

    All rows are in N·m: a velocity row is scaled by M̄/T_s, a position row by M̄/T_s², so that one
    tolerance fits all.

    Attributes:
        L: (r, N) lower-triangular Toeplitz blocks, one per kind.
        lower, upper: (r, n), ±inf where there is no bound.
        kinds: kind of each block of N rows.
        stopping: (2, n) where the lower, upper velocity row is the position limit's: below the joint's own
            limit, the velocity from which it can still stop. None where no row is.
        rest: (N, n) N·m, the values of the velocity rows when the joints come to rest, see `coming_to_rest`;
            None means zeros: the velocities stay constant.
    """

    L: Array
    lower: Array
    upper: Array
    kinds: tuple[Kind, ...]
    stopping: NDArray[np.bool_] | None = None
    rest: Array | None = None

    def kind(self, row: int, joint: int, upper: bool) -> Kind:
        """Which limit a joint meets at the upper or lower end of a row."""
        kind = self.kinds[row // self.L.shape[1]]
        stops = kind == "velocity" and self.stopping is not None and self.stopping[int(upper), joint]
        return "position" if stops else kind

    def knot(self, row: int) -> int:
        """The knot (1 … N; torque: 0 … N−1) whose value a row bounds."""
        N = self.L.shape[1]
        return row % N + (self.kinds[row // N] != "torque")

    def widened(self, slack: Array) -> Rows:
        """The rows with both bounds moved outward by `slack`, (r, n) ≥ 0."""
        return self._replace(lower=self.lower - slack, upper=self.upper + slack)


BRAKING = 20.0
"""1/s: decay rate of the velocity of a braking joint, which is almost at rest after a quarter of a second."""

REACTION = 5.0
"""Time constants of the velocity barrier that the viability bound allows before a joint really brakes."""


def reaction(limits: Limits, T_s: float) -> float:
    """Seconds that the viability bound allows before a joint brakes; T_s: control period, s."""
    return T_s + (REACTION / limits.velocity_approach if limits.velocity_approach else 0.0)


@lru_cache(maxsize=64)
def toeplitz(N: int, kinds: tuple[Kind, ...]) -> Array:
    """L of `Rows`."""
    lag = np.subtract.outer(np.arange(N), np.arange(N)).astype(float)
    blocks = {
        "torque": np.where(lag >= 0, 1.0, 0.0),
        "velocity": np.where(lag >= 0, lag + 1.0, 0.0),
        "position": np.where(lag >= 0, lag * (lag + 1.0) / 2.0, 0.0),
    }
    return np.vstack([blocks[kind] for kind in kinds])


@lru_cache(maxsize=64)
def approached(N: int, share: float) -> Array:
    """Share of the distance to a velocity bound that may be gone at knots 1 … N, (N, 1); 1 for share 0."""
    return 1.0 - np.asarray((1.0 - min(1.0, share or 1.0)) ** np.arange(1.0, N + 1)[:, None], np.float64)


def build_rows(
    state: JointState, tau_0: Array, M_bar: Array, limits: Limits, force: LimitsInForce, N: int, T_s: float
) -> Rows:
    """Bounds on torque, velocity and position at every knot.

    With `limits.position == "viability"` the position limit enters through the velocity rows, all
    knots using the measured q_k; with "paper" the rows are those of (32d): at knot 1 no Δτ can
    influence them, and nothing foresees the distance that stopping takes.

    Args:
        state: measured joint state, (n,) each.
        tau_0: torque applied last, (n,) N·m.
        M_bar: diagonal of M̄, (n,).
        limits: which bounds are imposed.
        force: their values.
        N: horizon.
        T_s: control period, s.
    """
    n = M_bar.size
    paper = limits.position == "paper"
    kinds: tuple[Kind, ...] = ("torque", "velocity", "position") if paper else ("torque", "velocity")
    # [lower, upper] side by side halves the number of array operations.
    bounds = np.empty((2, len(kinds) * N, n))
    bounds[:, :N] = (force.torque - tau_0)[:, None]

    stopping = None
    if limits.position == "viability":
        v = viability_bounds(state.q, *force.stops, force.v_limit, force.a_max, reaction(limits, T_s))
        stopping = np.array((-v[0] < force.v_limit, v[1] < force.v_limit))
    else:
        v = np.array((-force.v_limit, force.v_limit))
    scale = M_bar / T_s
    velocity = bounds[:, N : 2 * N]
    np.multiply(approached(N, limits.velocity_approach * T_s), ((v - state.v) * scale)[:, None], out=velocity)
    velocity -= state.gained_velocity(N, T_s) * scale
    if paper:
        q = np.array((force.q_lower, force.q_upper))[:, None]
        bounds[:, 2 * N :] = (q - state.free_position(N, T_s)) * (scale / T_s)
    rest = coming_to_rest(state, M_bar, N, T_s)
    return Rows(toeplitz(N, kinds), bounds[0], bounds[1], kinds, stopping, rest)


def coming_to_rest(state: JointState, M_bar: Array, N: int, T_s: float) -> Array:
    """Returns the values of the velocity rows (N, n), N·m, when velocities decay as e^{−BRAKING t}; arguments
    as in `build_rows`."""
    t = T_s * np.arange(1.0, N + 1)[:, None]
    return (np.expm1(-BRAKING * t) * state.v - state.gained_velocity(N, T_s)) * (M_bar / T_s)
