"""HIMPC on one page: hierarchical incremental MPC, sections III and IV of the HIMPC paper, in NumPy.

    himpc-lab run iiwa14-circle --controller himpc_printed

The controller `himpc_printed` computes its torques with these functions, and the tests compare the compiled
controllers with them. `himpc-lab new controller FILE.py --from himpc_one_page` copies this file, and
`Controller` is then a controller of your own. N knots, n joints, m rows of a level.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from himpc.cascade.level import LevelProblem
from himpc.constants import RANK_TOLERANCE
from himpc.qp import QPSolution, Solver, kkt_residual, solve_qp
from robots.arrays import Array

_NOISE = 1e-11
"""If the part of a row along the free directions is below this share of the row, it is a rounding error."""
_ROOM = 1e-9
"""N·m by which rows are widened for a second attempt: if U_{i−1} is almost the only feasible point, rows may
look contradictory. The optimum is then computed from the active rows with their exact bounds."""
_TOLERANCE = 1e-6
"""N·m: largest violation of a row that does not depend on the free directions."""


class Controller:
    """HIMPC. Its only memory is the last prediction, along which the Jacobians are computed (30)."""

    def __init__(self) -> None:
        self.predicted: Array | None = None  # q at knots 0 … N of the last plan

    def torque(self, now: Any) -> Any:
        """Returns the torque of every level, (n,) N·m. now: see `himpc.controllers.view.View`."""
        path = knots(self.predicted, now.q, now.q_dot, now.N, now.T_s)
        problems = [problem(now, level, path) for level in now.levels]
        optima = cascade(problems, *bounds(now), np.zeros((now.N, now.n)))
        U = optima[-1].U if optima else np.zeros((now.N, now.n))
        self.predicted = predict(now.q, now.q_dot, now.q_ddot, U, now.M_bar, now.T_s)
        return [now.tau_0 + solution.U[0] for solution in optima] or now.tau_0


def knots(predicted: Array | None, q: Array, q_dot: Array, N: int, T_s: float) -> Array:
    """Returns q̂ at knots 0 … N−1, (N, n), of (30): the last prediction, shifted to begin at the measured q.
    Where there is no prediction, and beyond its end, the velocity is constant."""
    if predicted is None:
        return q + T_s * np.arange(N)[:, None] * q_dot
    path = predicted[1:] + (q - predicted[1])
    step = path[-1] - path[-2] if len(path) > 1 else T_s * q_dot
    further = np.arange(1, N - len(path) + 1)[:, None] * step
    return np.vstack([path[:N], path[-1] + further])


def problem(now: Any, level: Any, path: Array) -> LevelProblem:
    """Returns Problem i: the residuals e = e⁰ + G U of (28), ẍ̃ + K_v ẋ̃ + K_p x̃ at knots 1 … N, and the
    weights of (31).

    The residuals follow from the incremental system (15): ẍ_{j+1} = ẍ_j + Ĵ M̄⁻¹ Δτ_j; ẋ and x are the sums
    of ẍ and ẋ over T_s. C is the contribution to the residual of an acceleration that has lasted for j
    periods.
    """
    N, T, K_p, K_v = now.N, now.T_s, level.K_p, level.K_v
    j = np.arange(N)[:, None]
    C = 1.0 + K_v * T * (j + 1) + K_p * T**2 * j * (j + 1) / 2  # (N, m)
    e = K_p * level.error + (K_v + K_p * T * (j + 1)) * level.x_dot + C * level.x_ddot
    desired = level.x_ddot_d[1:] + K_v * level.x_dot_d[1:] + K_p * level.displacement_d[1:]
    lag = np.subtract.outer(np.arange(N), np.arange(N))
    return LevelProblem(
        name=level.name,
        B=level.jacobian(path) / now.M_bar,  # Ĵ M̄⁻¹ at knots 0 … N−1, (N, m, n)
        C=np.where(lag[:, None] >= 0, C[np.maximum(lag, 0)].transpose(0, 2, 1), 0.0),
        free=e - desired,
        root_Q=np.sqrt(level.Q),
        R=level.R,
        knots=level.horizon,
    )


def bounds(now: Any) -> tuple[Array, Array, Array]:
    """Returns A, lower and upper of lower ≤ A U ≤ upper, in N·m: the bounds of the torque (32f), of the
    velocity (32e) and of the position (32d) at every knot, and other constraints such as distances."""
    N, T, limit, eye = now.N, now.T_s, now.bounds, np.eye(now.n)
    lag = np.maximum(np.subtract.outer(np.arange(N), np.arange(N)) + 1, 0)  # periods for which Δτ_s has acted
    j = np.arange(1, N + 1)[:, None]
    left = (1.0 - min(1.0, limit.approach * T or 1.0)) ** j
    gained = T * j * now.q_ddot  # q̇ at the knots minus q̇_k if Δτ = 0
    moved = T * j * now.q_dot + T**2 * j * (j - 1) / 2 * now.q_ddot  # q at the knots minus q_k if Δτ = 0

    def side(tau, v, q):
        yield np.tile(tau - now.tau_0, (N, 1))
        yield ((1.0 - left) * (v - now.q_dot) - gained) * now.M_bar / T
        if limit.paper:
            yield (q - now.q - moved) * now.M_bar / T**2

    profiles = [np.sign(lag), lag, lag * (lag - 1) / 2][: 3 if limit.paper else 2]
    further = now.further
    return (
        np.vstack(
            [np.kron(profile, eye) for profile in profiles]
            + [np.kron(f.profile, f.directions) for f in further]
        ),
        np.vstack(
            [*side(limit.tau_lower, limit.v_lower, limit.q_lower), *(f.lower for f in further)]
        ).ravel(),
        np.vstack(
            [*side(limit.tau_upper, limit.v_upper, limit.q_upper), *(f.upper for f in further)]
        ).ravel(),
    )


def predict(q: Array, q_dot: Array, q_ddot: Array, U: Array, M_bar: Array, T_s: float) -> Array:
    """Returns q at knots 0 … N, (N+1, n), by the incremental joint-space system (18)."""
    path = [q]
    for effort in U / M_bar:  # (17) with M̄⁻¹; the paper prints it without the inverse
        q = q + T_s * q_dot
        q_ddot = q_ddot + effort
        q_dot = q_dot + T_s * q_ddot
        path.append(q)
    return np.array(path)


class Optimum(NamedTuple):
    """The increments U after a level, (N, n) N·m, the multipliers of the rows, and the residual of the QP.

    Without an optimum, U contains the increments of the levels above.
    """

    U: Array
    multipliers: Array
    residual: float
    status: str
    qp_us: float = 0.0

    @property
    def solved(self) -> bool:
        return self.status in ("optimal", "empty")


def cascade(
    problems: Sequence[LevelProblem],
    A: Array,
    lower: Array,
    upper: Array,
    U: Array,
    first: int = 0,
    solver: Solver = "daqp",
) -> list[Optimum]:
    """Solves Problem `first` + 1 to Problem r in order. U, (N, n), is the result of the levels above.

    A level without an optimum keeps the increments of the levels above, which meet all bounds and
    priorities.
    """
    optima: list[Optimum] = []
    for i in range(first, len(problems)):
        if i:
            # U meets the bounds only up to rounding, but must be feasible for the levels below (Theorem 2).
            at = A @ U.ravel()
            lower, upper = np.minimum(lower, at), np.maximum(upper, at)
        optima.append(optimum(problems[i], U, problems[:i], A, lower, upper, solver))
        U = optima[-1].U
    return optima


def optimum(
    level: LevelProblem,
    U: Array,
    above: Sequence[LevelProblem],
    A: Array,
    lower: Array,
    upper: Array,
    solver: Solver,
) -> Optimum:
    """Returns the optimum of Problem i, (34): the least ‖e⁰ + G U_i‖²_Q + ‖U_i‖²_R with U_i = U_{i−1} + P y.

    For every y, J_p M̄⁻¹ Δτ keeps the value that the levels p above have chosen, so that the equality (33)
    needs no rows. Knots beyond the level's own horizon K keep the increments of the level above (Remark 8).
    The Hessian GᵀQG + R is never computed: its condition number can be 10¹⁷. In the coordinates y, which
    follow from a QR factorisation of [Q^½G; R^½], the Hessian is the identity.
    """
    K, n = level.knots, U.shape[1]
    root_R, root_Q, at = np.tile(np.sqrt(level.R), K), np.tile(level.root_Q, K), A @ U.ravel()
    Z = block_diagonal([null_space([higher.B[j] / root_R[:n] for higher in above], n) for j in range(K)])
    if not Z.shape[1]:
        return Optimum(U, np.zeros(len(A)), 0.0, "empty")
    T = Z / root_R[:, None]
    now = np.concatenate([root_Q * level.residual(U)[:K].ravel(), Z.T @ (root_R * U[:K].ravel())])
    basis, F = np.linalg.qr(np.vstack([root_Q[:, None] * (level.G @ T), np.eye(Z.shape[1])]))
    c, P = basis.T @ now, np.linalg.solve(F.T, T.T).T
    rows = A[:, : K * n] @ P
    length = np.linalg.norm(rows, axis=1)
    depends = length > _NOISE * (np.abs(A[:, : K * n]) @ (1.0 / root_R))
    if (np.maximum(lower - at, at - upper)[~depends] > _TOLERANCE).any():
        return Optimum(U, np.zeros(len(A)), 0.0, "infeasible")
    kept = np.flatnonzero(depends & (np.isfinite(lower) | np.isfinite(upper)))
    rows, length = rows[kept] / length[kept, None], length[kept]
    low, high = (lower - at)[kept] / length, (upper - at)[kept] / length

    def attempt(room: Array) -> QPSolution:
        wider = solve_qp(np.eye(c.size), c, rows, low - room, high + room, solver)
        return sharpened(wider, c, rows, low, high)

    solution = attempt(0.0 * length)
    solution = solution if solution.solved else attempt(_ROOM / length)
    if not solution.solved:
        status = "unsolved" if solution.status == "optimal" else solution.status
        return Optimum(U, np.zeros(len(A)), 0.0, status, solution.time_us)
    multipliers = np.zeros(len(A))
    multipliers[kept] = solution.multipliers / length
    step = np.vstack([(P @ solution.x).reshape(K, n), np.zeros((len(U) - K, n))])
    return Optimum(U + step, multipliers, solution.kkt_residual, "optimal", solution.time_us)


def null_space(rows: Sequence[Array], n: int) -> Array:
    """Returns an orthonormal basis of the directions that none of the rows, (m, n) each, changes: (33)."""
    Z = np.eye(n)
    for B in rows:
        _, sigma, right = np.linalg.svd(B @ Z)
        Z = Z @ right[int((sigma > RANK_TOLERANCE * np.linalg.norm(B)).sum()) :].T
    return Z


def sharpened(solution: QPSolution, c: Array, A: Array, low: Array, high: Array) -> QPSolution:
    """Returns the optimum of ½‖y + c‖² on the rows that are active at a solver's point, if it is better than
    this point: a solver's tolerance is 1e-9."""
    active = solution.multipliers != 0.0
    if not (active.any() and np.isfinite(solution.x).all()):
        return solution
    rows, bound = A[active], np.where(solution.multipliers > 0, high, low)[active]
    if not np.isfinite(bound).all():
        return solution
    y = np.linalg.lstsq(rows, bound + rows @ c)[0] - c
    multipliers = np.zeros(len(A))
    multipliers[active] = np.linalg.lstsq(rows.T, -c - y)[0]
    residual = kkt_residual(np.eye(c.size), c, A, low, high, y, multipliers)
    if not residual < solution.kkt_residual:
        return solution
    return QPSolution(y, multipliers, residual, "optimal", solution.time_us)


def block_diagonal(blocks: Sequence[Array]) -> Array:
    """Returns one matrix with the blocks along its diagonal."""
    columns = np.cumsum([0, *(block.shape[1] for block in blocks)])
    matrix = np.zeros((sum(map(len, blocks)), columns[-1]))
    for j, block in enumerate(blocks):
        matrix[j * len(block) : (j + 1) * len(block), columns[j] : columns[j + 1]] = block
    return matrix
