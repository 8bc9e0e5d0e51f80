"""If a level has no verified solution, the fallbacks are softened rows, the previous plan, and braking. They
satisfy all bounds if these are feasible."""

from __future__ import annotations

from typing import Any

import daqp
import numpy as np
import pytest
from broken_solver import NONSENSE, break_kernel, break_solver
from cascade_checks import assert_within, largest_difference, torque_rows
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from problems import Hierarchy, random_hierarchy

from himpc import qp
from himpc.cascade.last_resort import containing
from himpc.limits import Rows
from himpc.limits.rest import least_slack

Array = NDArray[np.float64]

seeds = st.integers(0, 2**32 - 1)


def unreachable(hierarchy: Hierarchy, excess: float = 1.0) -> Hierarchy:
    """Returns the hierarchy with a velocity bound at the first knot that no torque within its bounds can
    satisfy."""
    rows = hierarchy.rows
    N, n = hierarchy.shape
    lower, upper = rows.lower.copy(), rows.upper.copy()
    lower[:N], upper[:N] = -np.ones((N, n)), np.ones((N, n))
    # Every other bound is wide; joint 0 needs 1 + excess N·m and has at most 1 N·m.
    lower[N:], upper[N:] = -1e3, 1e3
    lower[N, 0] = 1.0 + excess
    return Hierarchy(hierarchy.problems, Rows(rows.L, lower, upper, rows.constraints))


@pytest.mark.parametrize("by", ["compiled", "printed"])
@pytest.mark.parametrize("seed", range(6))
def test_infeasible_rows_are_softened_by_the_least(seed: int, by: Any) -> None:
    """State rows are relaxed by the smallest feasible amount, and lower levels stay feasible (Theorem 2)."""
    hierarchy = unreachable(random_hierarchy(seed, 5, 4, 3))
    N, _ = hierarchy.shape
    solutions = hierarchy.solve(by)
    assert [solution.fallback for solution in solutions] == ["soften", "solve", "solve"]
    for solution in solutions:
        value = hierarchy.rows.L @ solution.U
        assert value[N, 0] == pytest.approx(1.0, abs=1e-6)
        short = np.maximum(value - hierarchy.rows.upper, hierarchy.rows.lower - value)
        short[N, 0] = 0.0
        assert short.max() <= 1e-6
        assert solution.kkt_residual <= 1e-6
    assert max(solution.leak for solution in solutions) <= 1e-6


@pytest.mark.parametrize("seed", range(4))
def test_softened_levels_agree(seed: int) -> None:
    """Both compute the same slack, and then the same increments."""
    hierarchy = unreachable(random_hierarchy(seed, 4, 3, 2))
    assert largest_difference(hierarchy.solve("compiled"), hierarchy.solve("printed")) <= 1e-6


def boxed(hierarchy: Hierarchy, past: float = 0.0) -> Hierarchy:
    """Returns the hierarchy with the same torque bounds at all knots; the bounds of joint 0 are shifted by
    `past` N·m."""
    rows = hierarchy.rows
    N, _ = hierarchy.shape
    lower, upper = rows.lower.copy(), rows.upper.copy()
    size = np.minimum(np.abs(lower[:N]), np.abs(upper[:N])).min(axis=0)
    lower[:N], upper[:N] = -size, size
    upper[:N, 0], lower[:N, 0] = upper[:N, 0] - past, lower[:N, 0] - past
    return Hierarchy(hierarchy.problems, Rows(rows.L, lower, upper, rows.constraints))


@pytest.fixture(scope="module")
def pressed() -> Hierarchy:
    """Returns three levels with active bounds; the normal cascade solves them."""
    tight = boxed(random_hierarchy(11, 5, 4, 3, room=0.3))
    rows = containing(tight.rows, np.zeros(tight.shape))
    hierarchy = Hierarchy(tight.problems, rows.widened(np.full(rows.lower.shape, 0.01)))
    assert not least_slack(hierarchy.rows).any()
    assert hierarchy.solve()[0].fallback == "solve"
    assert len(hierarchy.solve()[0].active)
    return hierarchy


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("solver", ["daqp", "proxqp"])
@pytest.mark.parametrize("kind", NONSENSE)
def test_a_broken_solver_falls_to_the_previous_plan(
    monkeypatch: pytest.MonkeyPatch, pressed: Hierarchy, kind: str, solver: qp.Solver
) -> None:
    """Level 1 continues its shifted plan, lower levels use the same increments, and all rows are
    satisfied."""
    previous = {s.name: s._replace(U=1e-4 * s.U) for s in pressed.solve()}
    break_solver(monkeypatch, kind)
    solutions = pressed.solve("printed", solver, previous)
    assert solutions[0].fallback == "previous"
    assert {solution.fallback for solution in solutions[1:]} <= {"inherit", "solve"}
    shifted = np.vstack([previous[solutions[0].name].U[1:], np.zeros((1, pressed.shape[1]))])
    np.testing.assert_array_equal(solutions[0].U, shifted)
    for solution in solutions:
        assert_within(pressed.rows, solution.U)


@pytest.mark.parametrize("stale", ["outside", "fallback"])
def test_a_previous_plan_outside_any_row_or_no_optimum_is_not_gone_on_with(
    monkeypatch: pytest.MonkeyPatch, pressed: Hierarchy, stale: str
) -> None:
    """The shifted plan satisfies the torque rows. If it violates a velocity row, or was itself a fallback,
    the joints are braked; otherwise they would continue their motion."""
    rows, (N, n) = pressed.rows, pressed.shape
    sound = {s.name: s._replace(U=np.zeros((N, n))) for s in pressed.solve()}
    if stale == "fallback":
        sound = {name: s._replace(fallback="previous") for name, s in sound.items()}
        moved = pressed
    else:
        lower = rows.lower.copy()
        lower[2 * N - 1] = 0.5 * np.minimum(
            rows.upper[2 * N - 1], (rows.L @ np.full((N, n), 1e-3))[2 * N - 1]
        )
        moved = Hierarchy(pressed.problems, rows._replace(lower=lower))
        assert not least_slack(moved.rows).any()
        assert_within(torque_rows(moved), np.zeros((N, n)))
    break_solver(monkeypatch, "unsolved")
    solutions = moved.solve("printed", "daqp", sound)
    assert solutions[0].fallback == "brake"
    for solution in solutions:
        assert_within(moved.rows, solution.U)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("kind", NONSENSE)
@pytest.mark.parametrize("by", ["compiled", "printed"])
def test_a_broken_solver_without_a_plan_brakes(
    monkeypatch: pytest.MonkeyPatch, pressed: Hierarchy, kind: str, by: Any
) -> None:
    """Without a previous plan the joints are braked within all rows, which are feasible here."""
    break_solver(monkeypatch, kind)
    if by == "compiled":
        break_kernel(monkeypatch)
    solutions = pressed.solve(by)
    assert solutions[0].fallback == "brake"
    for solution in solutions:
        assert np.isfinite(solution.U).all()
        assert_within(pressed.rows, solution.U)
        np.testing.assert_array_equal(solution.U, solutions[0].U)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_level_whose_solver_fails_inherits(monkeypatch: pytest.MonkeyPatch) -> None:
    """If only a lower level fails, it uses the increments of the level above, and reports the fallback."""
    hierarchy = random_hierarchy(11, 6, 4, 3, room=0.3)
    sound = hierarchy.solve()
    assert all(len(solution.active) for solution in sound[:2])
    break_kernel(monkeypatch, place=1)
    solutions = hierarchy.solve()
    np.testing.assert_array_equal(solutions[0].U, sound[0].U)
    assert [solution.fallback for solution in solutions][:2] == ["solve", "inherit"]
    np.testing.assert_array_equal(solutions[1].U, solutions[0].U)
    for solution in solutions:
        assert_within(hierarchy.rows, solution.U)


@given(seeds, st.integers(1, 6), st.integers(1, 5), st.booleans())
@settings(max_examples=60)
def test_whatever_the_rows_the_torque_rows_hold(seed: int, n: int, N: int, position_rows: bool) -> None:
    """For random, mostly contradictory state rows, a fallback returns a finite point within the torque
    bounds, and no level leaks."""
    hierarchy = random_hierarchy(seed, max(n, 2), N, 3, position_rows)
    rng = np.random.default_rng(seed)
    rows = hierarchy.rows
    shift = np.where(np.arange(len(rows.L)) < N, 0.0, 1.0)[:, None] * rng.normal(0, 50, rows.lower.shape)
    shifted = Rows(rows.L, rows.lower + shift, rows.upper + shift, rows.constraints)
    contradictory = boxed(Hierarchy(hierarchy.problems, shifted), past=float(rng.choice([0.0, 0.3])))
    solutions = contradictory.solve()
    assert solutions[0].fallback in ("solve", "soften", "feasible", "brake")
    for solution in solutions:
        assert np.isfinite(solution.U).all()
        assert solution.kkt_residual <= 1e-6
        assert solution.leak <= 1e-6
        assert_within(torque_rows(contradictory), solution.U)


@given(seeds, st.integers(1, 6), st.integers(1, 6), st.booleans())
@settings(max_examples=60)
def test_least_slack_makes_any_rows_feasible(seed: int, n: int, N: int, position_rows: bool) -> None:
    """Rows relaxed by the least slack are always feasible within the torque rows."""
    hierarchy = random_hierarchy(seed, max(n, 2), N, 1, position_rows)
    rng = np.random.default_rng(seed)
    rows = hierarchy.rows
    shift = np.where(np.arange(len(rows.L)) < N, 0.0, 1.0)[:, None] * rng.normal(0, 20, rows.lower.shape)
    shifted = Rows(rows.L, rows.lower + shift, rows.upper + shift, rows.constraints)
    slack = least_slack(shifted)
    assert (slack >= 0).all()
    assert not slack[:N].any()
    assert feasible(shifted.widened(slack + 1e-9 * (slack > 0)))


def feasible(rows: Rows) -> bool:
    """Whether all rows are feasible, computed by linear programming joint by joint."""
    from scipy.optimize import linprog

    N = rows.L.shape[1]
    for joint in range(rows.lower.shape[1]):
        lower, upper = rows.lower[:, joint], rows.upper[:, joint]
        A = np.vstack([rows.L[np.isfinite(upper)], -rows.L[np.isfinite(lower)]])
        b = np.concatenate([upper[np.isfinite(upper)], -lower[np.isfinite(lower)]]) + 1e-7
        if not linprog(np.zeros(N), A_ub=A, b_ub=b, bounds=(None, None), method="highs").success:
            return False
    return True


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("limit", [1, 7, 40])
def test_a_qp_takes_no_more_iterations_than_it_may(monkeypatch: pytest.MonkeyPatch, limit: int) -> None:
    """All attempts of DAQP together stay within their budget of iterations; a QP that was ended does not
    count as solved."""
    rng = np.random.default_rng(0)
    used: list[int] = []
    healthy = daqp.solve

    def counted(*arguments: Any, **options: Any) -> Any:
        found = healthy(*arguments, **options)
        used.append(found[3]["iterations"])
        return found

    monkeypatch.setattr(daqp, "solve", counted)
    k = 40
    f, width = 10 * rng.normal(size=k), 0.01
    A = np.vstack([np.eye(k), rng.normal(size=(k, k))])
    found = qp.solve_qp(np.eye(k), f, A, np.full(2 * k, -width), np.full(2 * k, width), iterations=limit)
    assert sum(used) <= limit + len(used)
    assert qp.solve_qp(np.eye(k), f, A, np.full(2 * k, -width), np.full(2 * k, width)).solved
    assert not found.solved or sum(used) > limit
