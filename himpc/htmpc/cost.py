"""The costs: tracking (8), effort (10), and the relaxed log barrier that softens (7c) and (7d)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from himpc.htmpc.kernel.cost import model
from himpc.htmpc.prediction import Start, integrator
from himpc.htmpc.rows import ConstraintRows
from himpc.htmpc.settings import Efforts
from robots.arrays import Array

MU = 1e-3
"""Weight of the barrier (the HTMPC authors' published value)."""
ZETA = 5e-3
"""Distance from a bound below which a parabola replaces the logarithm (the authors' value)."""


def gauss_newton(
    J: Array, Q: Array, e: Array, T_q: Array, effort: Array, share: float, ridge: float
) -> tuple[Array, Array]:
    """Returns the Hessian (k, k) and gradient (k,) of ½Σ eᵀQe with respect to the inputs. The blocks of the
    Hessian are Σ_k T_q[k, s] T_q[k, r] J_kᵀ Q_k J_k; a share of the effort's Hessian and a ridge are added.

    Args:
        J: (N, m, n), ∂e_k/∂q_k. Q, e: (N, m). T_q: (N, N), ∂q_k/∂u_s. effort: (k, k).
    """
    N, _, n = J.shape
    H, g = np.empty((N * n, N * n)), np.zeros(N * n)
    model(J, Q, e, T_q, effort, share, ridge, np.zeros((N, n, n)), np.zeros((N, n)), H, g)
    return H, g


@dataclass(frozen=True, eq=False)
class Effort:
    """The effort J_eff of (10): of the inputs U, or of their deviation from a reference plan.

    Attributes:
        weights: S, R, W.
        N: knots. dt: s.
    """

    weights: Efforts
    N: int
    dt: float

    @cached_property
    def hessian(self) -> Array:
        """The Hessian of (10), (N·n, N·n), constant."""
        T_v, _, D, _ = integrator(self.N, self.dt)
        w = self.weights
        H = np.kron(T_v.T @ T_v, np.diag(w.S)) + np.kron(np.eye(self.N), np.diag(w.R))
        return H + np.kron(D.T @ D, np.diag(w.W))

    def absolute(self, start: Start, U: Array) -> tuple[float, Array]:
        """Returns value and gradient (N·n,) of (10)."""
        T_v, _, D, _ = integrator(self.N, self.dt)
        w = self.weights
        V = start.v + T_v @ U
        change = D @ U
        change[0] -= start.u
        v, u, d = w.S * V, w.R * U, w.W * change
        value = 0.5 * float(np.vdot(v, V) + np.vdot(u, U) + np.vdot(d, change))
        return value, (T_v.T @ v + u + D.T @ d).ravel()

    def about(self, rest: tuple[float, Array], U: Array) -> tuple[float, Array]:
        """Returns value and gradient of (10) at U. (10) is quadratic: value and gradient at U = 0 are
        sufficient for this."""
        value, slope = rest
        u = U.ravel()
        change = self.hessian @ u
        return value + float(u @ (slope + 0.5 * change)), slope + change

    def relative(self, U: Array, plan: Array) -> tuple[float, Array]:
        """Returns value and gradient of the proximal effort: (10) applied to the deviation from a plan
        (N, n)."""
        gap = (U - plan).ravel()
        slope = self.hessian @ gap
        return 0.5 * float(gap @ slope), slope


def barrier(rows: ConstraintRows, u: Array) -> tuple[float, Array, Array]:
    """Returns the relaxed log barrier of all bounds: value, gradient (k,), Hessian (k, k) with respect to u.

    B(h) = −μ ln h for h ≥ ζ. Below ζ, B is a parabola; value and two derivatives are continuous at ζ.
    """
    above, below = np.isfinite(rows.upper), np.isfinite(rows.lower)
    h, B = _relaxed(rows, u)
    far, z = h >= ZETA, (h - 2.0 * ZETA) / ZETA
    first = np.where(far, -1.0 / np.maximum(h, ZETA), z / ZETA)
    second = np.where(far, 1.0 / np.maximum(h, ZETA) ** 2, 1.0 / ZETA**2)
    A = np.vstack([-rows.A[above], rows.A[below]])
    return MU * float(B.sum()), MU * (A.T @ first), MU * (A.T @ (second[:, None] * A))


def barrier_value(rows: ConstraintRows, u: Array) -> float:
    """Returns the value of `barrier` without its derivatives."""
    return MU * float(_relaxed(rows, u)[1].sum())


def _relaxed(rows: ConstraintRows, u: Array) -> tuple[Array, Array]:
    """Returns the distances h from all bounds, those from upper bounds first, and B(h) / μ."""
    value = rows.A @ u
    h = np.concatenate([rows.upper - value, value - rows.lower])
    h = h[np.isfinite(h)]
    z = (h - 2.0 * ZETA) / ZETA
    return h, np.where(h >= ZETA, -np.log(np.maximum(h, ZETA)), 0.5 * (z**2 - 1.0) - np.log(ZETA))
