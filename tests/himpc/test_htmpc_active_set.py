"""The compiled dual method finds the same points and multipliers as a QP solver, with and without a warm
start."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from himpc.htmpc.active_set import CONTRADICTION, ActiveSetSolver
from himpc.htmpc.rows import ConstraintRows
from himpc.qp import kkt_residual, solve_qp

Array = np.ndarray


def rows_of(A: Array, lower: Array, upper: Array) -> ConstraintRows:
    nothing = np.zeros(len(A), np.int64)
    return ConstraintRows(A, lower, upper, nothing, nothing, nothing)


def problem(
    rng: np.random.Generator, n: int, count: int, equal: int
) -> tuple[Array, Array, Array, Array, Array]:
    """Returns a feasible QP with bounds on both sides, some duplicate rows and some equalities."""
    root = rng.normal(size=(n, n))
    A = rng.normal(size=(count, n)) * 10.0 ** rng.uniform(-2, 1, (count, 1))
    A[: count // 4] = A[count // 2 : count // 2 + count // 4]
    inside = rng.normal(size=n)
    value = A @ inside
    lower, upper = value - rng.uniform(0, 1, count), value + rng.uniform(0, 1, count)
    lower[rng.random(count) < 0.3] = -np.inf
    upper[rng.random(count) < 0.3] = np.inf
    lower[-equal:] = upper[-equal:] = value[-equal:]
    return root @ root.T + 0.1 * np.eye(n), 10 * rng.normal(size=n), A, lower, upper


@settings(max_examples=80)
@given(seed=st.integers(0, 10**6), n=st.integers(3, 25), count=st.integers(4, 60), equal=st.integers(1, 2))
def test_points_and_residuals_are_those_of_a_solver(seed: int, n: int, count: int, equal: int) -> None:
    H, g, A, lower, upper = problem(np.random.default_rng(seed), n, count, equal)
    method = ActiveSetSolver()
    assert method.begin(H)
    found = method.solve(g, rows_of(A, lower, upper), 0)
    assert found.solved
    assert found.kkt_residual == pytest.approx(
        kkt_residual(H, g, A, lower, upper, found.x, found.multipliers), abs=1e-12
    )
    wanted = solve_qp(H, g, A, lower, upper)
    if wanted.solved:
        np.testing.assert_allclose(found.x, wanted.x, atol=1e-5)


@settings(max_examples=40)
@given(seed=st.integers(0, 10**6))
def test_a_warm_start_ends_where_a_cold_one_does(seed: int) -> None:
    """The subsequent QPs have different bounds, another gradient, and other rows at the end."""
    rng = np.random.default_rng(seed)
    H, g, A, lower, upper = problem(rng, 12, 40, 1)
    warm, cold = ActiveSetSolver(), ActiveSetSolver()
    assert warm.begin(H)
    warm.solve(g, rows_of(A, lower, upper), 0)
    for _ in range(3):
        shift = 0.3 * A @ rng.normal(size=12)
        g = g * rng.choice((0.0, 0.7))
        same = int(rng.integers(0, 40))
        A = A.copy()
        A[same:] *= rng.uniform(0.9, 1.0)
        lower, upper = lower + shift, upper + shift
        assert cold.begin(H)
        first = warm.solve(g, rows_of(A, lower, upper), same)
        again = cold.solve(g, rows_of(A, lower, upper), 0)
        assert first.status == again.status
        if first.solved:
            np.testing.assert_allclose(first.x, again.x, atol=1e-7)


def test_rows_that_contradict_each_other_are_found_out() -> None:
    rng = np.random.default_rng(1)
    H, g, A, lower, upper = problem(rng, 10, 30, 1)
    A[1], A[2] = A[0], 2.0 * A[0]
    lower[0], upper[0], lower[2], upper[2] = 1.0, 2.0, -np.inf, 1.0
    method = ActiveSetSolver()
    assert method.begin(H)
    found = method.solve(g, rows_of(A, lower, upper), 0)
    assert found.status == CONTRADICTION
    assert not found.solved


def test_numbers_that_are_none_are_not_solved() -> None:
    H, g, A, lower, upper = problem(np.random.default_rng(2), 6, 20, 1)
    method = ActiveSetSolver()
    assert not method.begin(-H)
    for broken in (np.nan, np.inf):
        assert method.begin(H)
        assert not method.solve(np.full(6, broken), rows_of(A, lower, upper), 0).solved
        hole = lower.copy()
        hole[3] = upper[3] = broken
        assert method.begin(H)
        found = method.solve(g, rows_of(A, hole, upper), 0)
        assert np.isfinite(found.x).all() or not found.solved
