"""The predictions agree with the printed matrices of (14), (15), (18) and (28)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from problems import level_problem

from himpc.prediction import JointState, residual_model
from himpc.printed import predict

Array = NDArray[np.float64]

horizons = st.integers(1, 20)
periods = st.floats(1e-4, 2e-2)
seeds = st.integers(0, 2**32 - 1)


def printed_task_system(m: int, T_s: float) -> tuple[Array, Array]:
    """Returns A₁ of (15), (6m, 6m), and the factor of J M̄⁻¹Δτ in B₁, (6m, m)."""
    eye, zero = np.eye(m), np.zeros((m, m))
    A_11 = np.block([[eye, T_s * eye, zero], [zero, 2 * eye, zero], [zero, zero, eye]])
    A_12 = np.block([[zero, zero, zero], [zero, -eye, zero], [zero, zero, zero]])
    A_1 = np.block([[A_11, A_12], [np.eye(3 * m), np.zeros((3 * m, 3 * m))]])
    return A_1, np.vstack([zero, T_s * eye, eye, np.zeros((3 * m, m))])


def printed_joint_system(n: int, T_s: float, M_bar: Array) -> tuple[Array, Array]:
    """Returns A₂ and B₂ of (18), (4n, 4n) and (4n, n), with M̄⁻¹ instead of M̄, which is a misprint in
    (17)."""
    eye, zero = np.eye(n), np.zeros((n, n))
    A_21 = np.block([[eye, T_s * eye], [zero, 2 * eye]])
    A_22 = np.block([[zero, zero], [zero, -eye]])
    A_2 = np.block([[A_21, A_22], [np.eye(2 * n), np.zeros((2 * n, 2 * n))]])
    return A_2, np.vstack([zero, T_s * np.diag(1 / M_bar), np.zeros((2 * n, n))])


def printed_residuals(
    x: Array, v: Array, a: Array, pushes: Array, K_p: Array, K_v: Array, x_d: Array, T_s: float
) -> Array:
    """Returns e of (28) at knots 1 … N. pushes: (N, m) J M̄⁻¹Δτ; x_d: (N+1, 3, m) with its derivatives."""
    N, m = pushes.shape
    A_1, into = printed_task_system(m, T_s)
    K = np.hstack([np.diag(K_p), np.diag(K_v), np.eye(m)])
    # By the backward difference ẋ(k−1) = ẋ(k) − T_s ẍ(k); x and ẍ at k−1 do not enter A₁.
    state = np.concatenate([x, v, a, np.zeros(m), v - T_s * a, np.zeros(m)])
    found = np.empty((N, m))
    for j in range(N):
        # Knot j+1 = A₁^(j+1) state + Σ A₁^(j−s) B₁ push_s.
        ahead = np.linalg.matrix_power(A_1, j + 1) @ state
        for s in range(j + 1):
            ahead = ahead + np.linalg.matrix_power(A_1, j - s) @ into @ pushes[s]
        found[j] = K @ ahead[: 3 * m] - K @ x_d[j + 1].ravel()
    return found


@given(seed=seeds, N=horizons, m=st.integers(1, 4), n=st.integers(1, 7), T_s=periods)
@settings(max_examples=80)
def test_residuals_equal_the_printed_system(seed: int, N: int, m: int, n: int, T_s: float) -> None:
    """For all gains, the scalar effects c_l give the same e as the powers of the printed A₁."""
    rng = np.random.default_rng(seed)
    K_p, K_v = rng.uniform(0, 500, m), rng.uniform(0, 50, m)
    x, v, a = rng.normal(0, [[1], [3], [10]], (3, m))
    x_d = rng.normal(0, 1, (N + 1, 3, m))
    B, U = rng.normal(0, 10, (N, m, n)), rng.normal(0, 1, (N, n))
    pushes = np.einsum("jmn,jn->jm", B, U)

    model = residual_model(K_p, K_v, N, T_s)
    free = model.free(x - x_d[0, 0], v, a, x_d[1:, 0] - x_d[0, 0], x_d[1:, 1], x_d[1:, 2])
    scale = 1 + np.abs(pushes).sum() + np.abs(x_d).max() * 600 + 2000
    expected = printed_residuals(x, v, a, np.zeros_like(pushes), K_p, K_v, x_d, T_s)
    np.testing.assert_allclose(free, expected, rtol=1e-10, atol=1e-12 * scale)

    problem = level_problem("level", B, model.C, free, np.ones(m), np.ones(n))
    expected = printed_residuals(x, v, a, pushes, K_p, K_v, x_d, T_s)
    np.testing.assert_allclose(problem.residual(U), expected, rtol=1e-10, atol=1e-11 * scale)


@given(seed=seeds, N=horizons, n=st.integers(1, 9), T_s=periods)
@settings(max_examples=80)
def test_joint_predictions_equal_the_printed_system(seed: int, N: int, n: int, T_s: float) -> None:
    """q and q̇ over the horizon are those that the printed A₂ and B₂ give."""
    rng = np.random.default_rng(seed)
    q, v, a = rng.normal(0, [[1], [3], [30]], (3, n))
    M_bar, U = 10 ** rng.uniform(-3.5, 1, n), rng.normal(0, 1, (N, n))
    A_2, B_2 = printed_joint_system(n, T_s, M_bar)
    state = np.concatenate([q, v, np.zeros(n), v - T_s * a])
    positions, velocities = [q], [v]
    for increment in U:
        state = A_2 @ state + B_2 @ increment
        positions.append(state[:n])
        velocities.append(state[n : 2 * n])
    given_state = JointState(q, v, a)
    scale = 1 + np.abs(velocities).max()
    np.testing.assert_allclose(predict(*given_state, U, M_bar, T_s), positions, atol=1e-10 * scale)
    still = np.zeros_like(U)
    alone = predict(*given_state, still, M_bar, T_s)[1:]
    np.testing.assert_allclose(given_state.free_position(N, T_s), alone)
    coast = [v + (1 + k) * T_s * a for k in range(N)]
    np.testing.assert_allclose(given_state.v + given_state.gained_velocity(N, T_s), coast)


@given(seed=seeds, N=st.integers(1, 10), m=st.integers(1, 4), n=st.integers(1, 7), shorter=st.integers(0, 9))
@settings(max_examples=60)
def test_cost_is_the_printed_sum(seed: int, N: int, m: int, n: int, shorter: int) -> None:
    """`cost` is Σ ‖e‖²_Q + ‖Δτ‖²_R of (31), summed over the knots of the level."""
    rng = np.random.default_rng(seed)
    knots = max(1, N - shorter)
    Q, R = 10 ** rng.uniform(-1, 3, m), 10 ** rng.uniform(-2, 2, n)
    model = residual_model(rng.uniform(0, 500, m), rng.uniform(0, 50, m), N, 1e-3)
    B, free, U = rng.normal(0, 10, (N, m, n)), rng.normal(0, 5, (N, m)), rng.normal(0, 1, (N, n))
    problem = level_problem("level", B, model.C, free, Q, R, knots)
    total = 0.0
    for j in range(knots):
        e = free[j].copy()
        for s in range(j + 1):
            e = e + model.C[j, :, s] * (B[s] @ U[s])
        total += e @ np.diag(Q) @ e + U[j] @ np.diag(R) @ U[j]
    assert problem.cost(U) == pytest.approx(total, rel=1e-10)


def test_position_at_the_first_knot_has_no_input() -> None:
    """In the printed Euler step, Δτ₀ changes q only from knot 2 on. With N = 1, therefore, the effect of the
    input does not contain K_p."""
    state = JointState(np.zeros(2), np.ones(2), np.zeros(2))
    U = np.array([[1.0, -1.0], [0.0, 0.0]])
    np.testing.assert_array_equal(predict(*state, U, np.ones(2), 1e-3)[1], 1e-3 * np.ones(2))
    assert residual_model(np.array([200.0]), np.array([10.0]), 1, 1e-3).C[0, 0, 0] == pytest.approx(1.01)
