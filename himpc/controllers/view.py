"""The data that a user's own controller receives at every tick, in the symbols of the HIMPC paper."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robots import NominalModel

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LevelView:
    """One level of the hierarchy at this tick. m is the number of coordinates of all its tasks together.

    Attributes:
        name: the level's name; "damping" for the level that damps the directions that no other level uses.
        tasks: names of its tasks.
        x: values of its tasks by name: coordinates (m,), or a rotation matrix (3, 3).
        error: x̃ = x − x_d, (m,) m or rad; for rotations log₃(R R_dᵀ), and on fewer than three axes the error
            of `OrientationTask`.
        x_dot: ẋ = J q̇, (m,).
        x_ddot: ẍ, the backward difference of ẋ, (m,).
        J: J_i of (3) at the measured q, (m, n).
        J_dot_q_dot: J̇ q̇, (m,).
        displacement_d: x_d(k+j) − x_d(k), j = 0 … N, (N+1, m).
        x_dot_d, x_ddot_d: ẋ_d and ẍ_d at k … k+N, (N+1, m).
        K_p, K_v: gains of (4), (m,).
        Q: weight of the residual (28), (m,).
        R: weight of the increments Δτ in (31), (n,).
        horizon: number of knots that the level looks ahead, at most N (Remark 8).
        jacobian: J at another configuration, (n,) → (m, n), or at those of knots 0 … N−1, (N, n) → (N, m, n).
            At later knots, targets that move have moved, too.
    """

    name: str
    tasks: tuple[str, ...]
    x: dict[str, Array]
    error: Array
    x_dot: Array
    x_ddot: Array
    J: Array
    J_dot_q_dot: Array
    displacement_d: Array
    x_dot_d: Array
    x_ddot_d: Array
    K_p: Array
    K_v: Array
    Q: Array
    R: Array
    horizon: int
    jacobian: Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class Bounds:
    """The bounds of this tick; infinite for limits that are not imposed.

    Attributes:
        tau_lower, tau_upper: (n,) N·m.
        v_lower, v_upper: bounds on the next velocity, (n,) rad/s. With position limits by viability they
            include the velocity from which a joint can still stop before its limit.
        q_lower, q_upper: (n,) rad.
        approach: 1/s, largest rate at which the distance to a velocity bound may shrink; 0: no such limit.
        paper: whether the position limits are imposed by the rows (32d), as printed.
    """

    tau_lower: Array
    tau_upper: Array
    v_lower: Array
    v_upper: Array
    q_lower: Array
    q_upper: Array
    approach: float
    paper: bool


@dataclass(frozen=True, eq=False)
class Further:
    """A constraint besides (32d)–(32f): lower ≤ L U Dᵀ ≤ upper, see `himpc.limits.constraint`.

    Attributes:
        profile: L, (N, N).
        directions: D, (n, n).
        lower, upper: (N, n) N·m, ±inf where there is no bound.
    """

    profile: Array
    directions: Array
    lower: Array
    upper: Array


@dataclass(frozen=True, eq=False)
class NearView:
    """The r pairs of two links, or of a link and an object, that could reach d_safe first, sorted by
    distance. r is 0 if `avoidance.on` is false. Pairs that are farther apart than 0.25 m are left out.

    Attributes:
        names: the name of each pair.
        d: distance, (r,) m, negative inside.
        gradient: ∇d at the measured q, (r, n) m/rad.
        d_safe: the distance to keep, with its margin, (r,) m; smaller for links that are close together at
            home.
        moving: speed at which the object's own motion reduces d, (r,) m/s.
        reaction: t, time before the robot brakes, as the bound assumes, s.
        deceleration: a, deceleration of the decrease of d, as the bound assumes, m/s².
    """

    names: tuple[str, ...]
    d: Array
    gradient: Array
    d_safe: Array
    moving: Array
    reaction: float
    deceleration: float


@dataclass(frozen=True, eq=False)
class View:
    """All data that a controller receives at tick k. Arrays are read-only.

    Attributes:
        q, q_dot: measured, (n,) rad and rad/s.
        q_ddot: the backward difference of q̇, (n,).
        tau_0: the torque that acted during the last period, (n,) N·m.
        T_s: control period, s.
        N: horizon, knots.
        M_bar: diagonal of M̄, (n,) kg·m².
        levels: highest priority first.
        bounds: the bounds of this tick.
        near: the distances to keep.
        further: the constraints besides (32d)–(32f) that are imposed, such as distances.
        nominal: the nominal dynamic model, for model-based controllers.
    """

    q: Array
    q_dot: Array
    q_ddot: Array
    tau_0: Array
    T_s: float
    N: int
    M_bar: Array
    levels: tuple[LevelView, ...]
    bounds: Bounds
    near: NearView
    further: tuple[Further, ...]
    nominal: NominalModel

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.q.size

    @cached_property
    def M(self) -> Array:
        """Nominal inertia matrix at q, (n, n) kg·m²."""
        return read_only(self.nominal.mass_matrix(self.q))

    @cached_property
    def bias(self) -> Array:
        """Nominal C q̇ + g + friction, the torque that keeps q̈ = 0, (n,) N·m."""
        return read_only(self.nominal.bias(self.q, self.q_dot))

    @cached_property
    def gravity(self) -> Array:
        """Nominal g(q), (n,) N·m."""
        return read_only(self.nominal.bias(self.q, np.zeros(self.n)))

    def level(self, name: str) -> LevelView:
        """Returns a level by its name. Raises KeyError, naming the available levels."""
        for level in self.levels:
            if level.name == name:
                return level
        raise KeyError(f"no level '{name}' is on: there are {', '.join(level.name for level in self.levels)}")


def read_only(values: Array) -> Array:
    """Returns a read-only copy of an array."""
    array = np.array(values, float)
    array.flags.writeable = False
    return array
