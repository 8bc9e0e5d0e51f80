"""Prioritised torques by dynamically consistent null-space projection: the common law of OSF and TDEOSF."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter_ns
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import NO_ROWS, LevelSolution
from himpc.controllers.one_step import Demand, Law, leak

Array = NDArray[np.float64]

ROUNDING = 1e-10
"""Singular values below this share of ‖J_i L⁻ᵀ‖, where M = L Lᵀ, are rounding errors and count as zero."""

DAMPED = 0.2
"""Value of `damping` in the damped variants. On RT2 of the HIMPC paper, OSF with 0.1 demands 18 times the
torque limit; with 0.4 the error of level 1 is a quarter larger than with 0.2. RT1 never comes that near to a
singularity."""


class Projected(NamedTuple):
    """The torque of all levels from the first down to this one.

    Attributes:
        torque: sum of the levels' torques so far, without the bias, (n,) N·m.
        lost: number of directions that are lost to a singularity: the level has rows for them, and the levels
            above leave them free.
    """

    torque: Array
    lost: int


def prioritised_torques(
    M: Array, jacobians: Sequence[Array], accelerations: Sequence[Array], damping: float = 0.0
) -> list[Projected]:
    """Returns Σ_p J_{p|prec}ᵀ Λ_{p|prec} (ẍ_p − J_p M⁻¹ Σ_{s<p} τ_s) for every level, highest priority first.

    J_{p|prec} is J_p projected into the directions that the levels above leave free, and Λ_{p|prec} is the
    inverse of J_{p|prec} M⁻¹ J_{p|prec}ᵀ. With M = L Lᵀ (Cholesky) and the coordinates z = Lᵀ q̈, the
    dynamically consistent inverse is the Moore–Penrose inverse of J_p L⁻ᵀ, restricted to the free directions.
    Every projector is then orthogonal, and no product of small numbers is inverted.

    Without damping, the torque near a singularity grows as 1/σ without a limit. If σ is only a rounding
    error, the direction is dropped. With damping, σ/ε² replaces 1/σ for σ below ε = damping · ‖J_p L⁻ᵀ‖. This
    is damped least squares with λ² = ε² − σ². For larger σ nothing changes. The priorities stay exact.

    Args:
        M: inertia matrix, (n, n) kg·m², positive definite.
        jacobians: J_p, (m_p, n).
        accelerations: desired ẍ_p − J̇_p q̇, (m_p,).
        damping: singular values below this share of ‖J_p L⁻ᵀ‖ are damped; 0: no damping.

    Raises:
        numpy.linalg.LinAlgError: M is not positive definite, or a value is not finite.
    """
    root = np.linalg.cholesky(M)
    free = np.eye(len(M))
    force = np.zeros(len(M))
    projected = []
    for J, wanted in zip(jacobians, accelerations, strict=True):
        W = np.linalg.solve(root, J.T).T
        size = float(np.linalg.norm(W))
        left, sigma, right, rest = split(W @ free, size)
        gain = sigma / np.maximum(sigma, damping * size) ** 2
        force = force + free @ (right @ (gain * (left.T @ (wanted - W @ force))))
        projected.append(Projected(root @ force, min(len(J), free.shape[1]) - sigma.size))
        free = free @ rest
    return projected


def projected_law(M: Array, bias: Array, tau_0: Array, demands: list[Demand], damping: float) -> Law:
    """Returns `prioritised_torques` with the evidence of every level. There is no QP, so the KKT residual is
    NaN.

    Args:
        M, bias: the controller's model M q̈ + bias = τ.
        tau_0: torque applied last, (n,) N·m; increments in the cost (31) are relative to it.
        demands: the levels.
        damping: as in `prioritised_torques`.
    """
    started = perf_counter_ns()
    projected = prioritised_torques(M, [d.J for d in demands], [d.acceleration for d in demands], damping)
    inverse = np.asarray(np.linalg.inv(M), np.float64)
    accelerations = [inverse @ projection.torque for projection in projected]
    time_us = (perf_counter_ns() - started) / 1e3 / max(len(demands), 1)
    levels = []
    for i, (demand, projection) in enumerate(zip(demands, projected, strict=True)):
        error = demand.residual(demand.J @ accelerations[i])
        increment = bias + projection.torque - tau_0
        levels.append(
            LevelSolution(
                name=demand.form.level.name,
                U=projection.torque[None],
                cost=float(error @ error + (demand.form.R * increment) @ increment),
                active=NO_ROWS,
                kkt_residual=float("nan"),
                status=f"directions lost: {projection.lost}" if projection.lost else "optimal",
                fallback="solve",
                time_us=time_us,
                qp_us=0.0,
                leak=leak(demands, accelerations, i),
            )
        )
    return Law(bias, levels)


def split(A: Array, size: float) -> tuple[Array, Array, Array, Array]:
    """Decomposes A = left · diag(sigma) · rightᵀ without singular values that are rounding errors, and
    returns its null space.

    Args:
        A: (m, d).
        size: a norm; singular values are compared with it.

    Returns:
        left (m, r), sigma (r,), right (d, r) and an orthonormal basis (d, d − r) of the null space of A.
    """
    left, sigma, right = np.linalg.svd(A, full_matrices=True)
    rank = int((sigma > ROUNDING * size).sum())
    return left[:, :rank], sigma[:rank], right[:rank].T, right[rank:].T
