"""HIMPC on one page: hierarchical incremental MPC, sections III and IV of the HIMPC paper.

    himpc-lab run iiwa14-circle --controller himpc_one_page.py

The torque is that of the lab's own HIMPC. This file has no fallbacks, and it is slower. N knots, n joints, m
rows of a level.
"""

import numpy as np

from himpc.qp import solve_qp


class Controller:
    """HIMPC. Its only memory is the last prediction, along which the Jacobians are computed (30)."""

    def __init__(self):
        self.predicted = None  # q at knots 0 … N of the last plan

    def torque(self, now):
        N, n = now.N, now.n
        knots = self.knots(now)
        rows, lower, upper = bounds(now)
        U = np.zeros(N * n)  # all increments Δτ_0 … Δτ_{N−1}, one after the other
        Z = [np.eye(n)] * N  # basis of the directions that the levels above leave free, per knot (33)
        torques = []
        for level in now.levels:
            B = np.array([level.jacobian(q) for q in knots]) / now.M_bar  # Ĵ M̄⁻¹, (N, m, n)
            U = U + self.optimum(now, level, B, U, Z, rows, lower, upper)
            torques.append(now.tau_0 + U[:n])
            # U meets the bounds only up to rounding, but must be feasible for the levels below (Theorem 2).
            lower, upper = np.minimum(lower, rows @ U), np.maximum(upper, rows @ U)
            Z = [shrunk(Z[j], B[j]) for j in range(N)]
        self.predicted = predict(now, U.reshape(N, n))
        return torques or now.tau_0

    def knots(self, now):
        """Returns q̂ at knots 0 … N−1: the last prediction, moved so that it begins at the measured q
        (30)."""
        if self.predicted is None or len(self.predicted) != now.N + 1:
            return [now.q + j * now.T_s * now.q_dot for j in range(now.N)]
        path = self.predicted[1:]
        return path + (now.q - path[0])

    def optimum(self, now, level, B, U, Z, rows, lower, upper):
        """Returns the optimal change of U for a level: Problem i, (34), with U_i = U_{i−1} + Z y.

        For every y, J_p M̄⁻¹ Δτ keeps the value that the levels p above have chosen, so that the equality (33)
        needs no rows.
        """
        basis = block_diagonal(Z)
        if not basis.shape[1]:
            return np.zeros_like(U)
        G, free = residual(now, level, B)
        Q, R = np.tile(level.Q, now.N), np.tile(level.R, now.N)
        H = G.T @ (Q[:, None] * G) + np.diag(R)
        f = G.T @ (Q * (free + G @ U)) + R * U
        low, high = lower - rows @ U, upper - rows @ U
        return basis @ solve_qp(basis.T @ H @ basis, basis.T @ f, rows @ basis, low, high).x


def residual(now, level, B):
    """Returns G and e⁰ of the stacked residuals e = e⁰ + G U at knots 1 … N, (28): ẍ̃ + K_v ẋ̃ + K_p x̃.

    The residuals follow from the incremental system (15): ẍ_{j+1} = ẍ_j + Ĵ M̄⁻¹ Δτ_j; ẋ and x are the sums
    of ẍ and ẋ over T_s.
    """
    N, (m, n) = now.N, level.J.shape
    T, K_p, K_v = now.T_s, level.K_p, level.K_v

    def weight(j):
        """Returns the contribution to the residual of an acceleration that has lasted for j periods."""
        return 1.0 + K_v * T * (j + 1) + K_p * T**2 * j * (j + 1) / 2

    G, free = np.zeros((N, m, N, n)), np.empty((N, m))
    for j in range(N):
        for s in range(j + 1):
            G[j, :, s] = weight(j - s)[:, None] * B[s]
        e = K_p * level.error + (K_v + K_p * T * (j + 1)) * level.x_dot + weight(j) * level.x_ddot
        desired = level.x_ddot_d[j + 1] + K_v * level.x_dot_d[j + 1] + K_p * level.displacement_d[j + 1]
        free[j] = e - desired
    return G.reshape(N * m, N * n), free.ravel()


def bounds(now):
    """Returns rows, lower and upper of lower ≤ rows U ≤ upper: the bounds of the torque (32f) and of the
    velocity (32e) at every knot, all in N·m."""
    N, T, limit, eye = now.N, now.T_s, now.bounds, np.eye(now.n)
    lag = np.subtract.outer(np.arange(N), np.arange(N))
    rows = np.vstack([np.kron(lag >= 0, eye), np.kron(np.maximum(lag + 1, 0), eye)])
    left = (1.0 - min(1.0, limit.approach * T or 1.0)) ** np.arange(1, N + 1)[:, None]
    gained = T * np.arange(1, N + 1)[:, None] * now.q_ddot  # q̇ at the knots minus q̇_k if Δτ = 0

    def side(tau, v):
        velocity = ((1.0 - left) * (v - now.q_dot) - gained) * now.M_bar / T
        return np.concatenate([np.tile(tau - now.tau_0, N), velocity.ravel()])

    return rows, side(limit.tau_lower, limit.v_lower), side(limit.tau_upper, limit.v_upper)


def predict(now, U):
    """Returns q at knots 0 … N by the incremental joint-space system (18)."""
    q, v, a = now.q, now.q_dot, now.q_ddot
    path = [q]
    for effort in U / now.M_bar:
        q = q + now.T_s * v
        a = a + effort
        v = v + now.T_s * a
        path.append(q)
    return np.array(path)


def shrunk(Z, B):
    """Returns an orthonormal basis of the directions of Z that B maps to zero: the freedom of lower
    levels."""
    _, sigma, right = np.linalg.svd(B @ Z)
    return Z @ right[int((sigma > 1e-10 * np.linalg.norm(B)).sum()) :].T


def block_diagonal(blocks):
    """Returns one matrix with the blocks along its diagonal."""
    sizes = np.cumsum([0, *(each.shape[1] for each in blocks)])
    found = np.zeros((sum(len(each) for each in blocks), sizes[-1]))
    for j, each in enumerate(blocks):
        found[j * len(each) : (j + 1) * len(each), sizes[j] : sizes[j + 1]] = each
    return found
