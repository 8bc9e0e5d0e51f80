"""Transforms a level's problem to white coordinates, in which its Hessian is the identity and every point
satisfies (33)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import LevelProblem

Array = NDArray[np.float64]


_FELT = 1e-13
"""If the effect of a direction on a level is below this share of the size of the level's rows, the effect is
a rounding error."""
_APART = 1e-6
"""A singular value below this share of the previous singular value belongs to a direction that no row
fixes."""


class WhiteLevel(NamedTuple):
    """The problem min ½‖y + c‖² over y, where U = U_{i−1} + P y at the knots that the level looks ahead.

    Attributes:
        c: (d,), minus the optimum without bounds.
        P: (K·n, d), N·m per unit of y.
    """

    c: Array
    P: Array


def white(problem: LevelProblem, U_above: Array, upper: Sequence[Array], Z: Array) -> WhiteLevel:
    """Returns Problem i, (32) or (34), in white coordinates, from its least-squares form ‖Q^½ e‖² + ‖R^½ U‖².

    H = GᵀQG + R is never computed: if weights or inertias differ greatly, its condition number is 10¹⁷ and R
    is lost in rounding. Instead, at each knot √R ∘ U is rotated into directions that change the level's
    residual and directions that do not. A direction belongs to the second group if its effect is a rounding
    error, see _FELT. Only bounds need the second group. The first group is reduced by a QR factorisation.

    Args:
        problem: the level's data.
        U_above: U_{i−1}, (N, n).
        upper: B_p of every level above, (N, m_p, n).
        Z: orthonormal bases of the directions that (33) leaves free, (N, n, d); surplus columns are zero.
    """
    K, m = problem.knots, problem.B.shape[1]
    root_R = np.sqrt(problem.R)
    felt, unfelt = [], []
    effect = []
    for j in range(K):
        B = problem.B[j] / root_R
        basis = _free(np.vstack([each[j] for each in upper]) / root_R if upper else None, root_R, Z[j])
        left, singular, Vt = np.linalg.svd(B @ basis)
        count = int((singular > _FELT * np.sqrt((B * B).sum())).sum())
        turned = basis @ Vt.T
        felt.append(turned[:, :count])
        unfelt.append(turned[:, count:])
        weighted = problem.root_Q * problem.C[:K, :, j]
        effect.append(weighted[:, :, None] * (left[:, :count] * singular[:count]))
    T, S = _diagonal(felt), _diagonal(unfelt)
    effort = (root_R * U_above[:K]).ravel()
    e = problem.root_Q * problem.residual(U_above)[:K]
    G = np.concatenate(effect, axis=2).reshape(K * m, T.shape[1])
    Q, F = np.linalg.qr(np.vstack([G, np.eye(T.shape[1])]))
    c = Q.T @ np.concatenate([e.ravel(), T.T @ effort])
    own = np.linalg.solve(F.T, T.T).T if T.size else T
    return WhiteLevel(np.concatenate([c, S.T @ effort]), np.hstack([own, S]) / np.tile(root_R, K)[:, None])


def _free(rows: Array | None, root_R: Array, Z: Array) -> Array:
    """Returns an orthonormal basis of √R ∘ span Z, (n, d). If the weights R of the joints differ greatly, it
    is computed from the rows (33) instead of Z, since Z has lost the digits of joints with small weights."""
    Z = Z[:, Z.any(axis=0)]
    rank = len(root_R) - Z.shape[1]
    if rows is not None and len(rows) >= rank:
        even = (rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), np.finfo(float).tiny)).T
        if len(rows) == rank:
            return np.linalg.qr(even, mode="complete")[0][:, rank:]
        left, singular, _ = np.linalg.svd(even)
        if singular[rank:].max(initial=0.0) < _APART * singular[rank - 1]:
            return left[:, rank:]
    return np.linalg.qr(root_R[:, None] * Z)[0]


def _diagonal(blocks: list[Array]) -> Array:
    """Returns a matrix with the blocks (n, d_j) along its diagonal."""
    rows = np.cumsum([0, *(block.shape[0] for block in blocks)])
    columns = np.cumsum([0, *(block.shape[1] for block in blocks)])
    matrix = np.zeros((rows[-1], columns[-1]))
    for j, block in enumerate(blocks):
        matrix[rows[j] : rows[j + 1], columns[j] : columns[j + 1]] = block
    return matrix
