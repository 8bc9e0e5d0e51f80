"""Orthonormal bases of the directions that the priority constraints (33) leave free at each knot."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from himpc.constants import RANK_TOLERANCE

Array = NDArray[np.float64]

CLEARLY_REGULAR = 1e-5
"""If all diagonal entries of a triangular factor exceed this share of the largest entry, the rank is full."""


def nested_bases(levels: Sequence[Array]) -> list[Array]:
    """Returns orthonormal bases Z_i of {z : B_p z = 0 for all p < i} at every knot, for i = 2 … r+1.

    Away from singularities, one Householder QR of [B_1ᵀ … B_rᵀ] contains all bases: Z_i consists of the
    columns of Q after those of the levels above. Near a singularity, an SVD per level determines the rank.

    Args:
        levels: B_p = Ĵ_p M̄⁻¹ of each level above the last, (N, m_p, n).

    Returns:
        r arrays (N, n, d_i).
    """
    if not levels:
        return []
    N, _, n = levels[0].shape
    sizes = list(accumulate(B.shape[1] for B in levels))
    if sizes[-1] <= n:
        stacked = np.concatenate(levels, axis=1).transpose(0, 2, 1)
        Q, R = np.linalg.qr(stacked, mode="complete")
        pivots = R.diagonal(axis1=1, axis2=2)
        if float(np.abs(pivots).min()) > CLEARLY_REGULAR * float(np.abs(stacked).max()):
            return [Q[:, :, end:] for end in sizes]
    bases = []
    Z = np.broadcast_to(np.eye(n), (N, n, n))
    for B in levels:
        Z = shrink(Z, B) if Z.shape[2] else Z
        bases.append(Z)
    return bases


@lru_cache(maxsize=8)
def whole_space(N: int, n: int) -> Array:
    """Returns the basis of level 1, (N, n, n): all directions are free."""
    return np.tile(np.eye(n), (N, 1, 1))


def shrink(Z: Array, B: Array) -> Array:
    """Returns orthonormal bases of {z ∈ span Z_j : B_j z = 0} at every knot j.

    Nothing is inverted: the bases come from an SVD of B_j Z_j. Where the rank differs between knots,
    surplus columns are zero, so that all knots keep one shape.

    Args:
        Z: (N, n, d) orthonormal columns (or zero columns).
        B: (N, m, n).

    Returns:
        (N, n, d') with d' ≤ d; d' = 0 if no knot has freedom left.
    """
    N, n, _ = Z.shape
    tolerance = RANK_TOLERANCE * np.sqrt((B * B).sum(axis=(1, 2)))
    _, singular, Vt = np.linalg.svd(B @ Z)
    free = []
    for j in range(N):
        basis = Z[j] @ Vt[j, int((singular[j] > tolerance[j]).sum()) :].T
        if not Z[j].any(axis=0).all():
            # Null vectors that belong to zero columns of Z become zero. The other null vectors give an
            # orthonormal basis.
            left, kept, _ = np.linalg.svd(basis, full_matrices=False)
            basis = left[:, kept > 0.5]
        free.append(basis)
    shrunk = np.zeros((N, n, max(basis.shape[1] for basis in free)))
    for j, basis in enumerate(free):
        shrunk[j, :, : basis.shape[1]] = basis
    return shrunk
