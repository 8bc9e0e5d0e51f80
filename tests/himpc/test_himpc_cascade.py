"""The cascade: two routes to one optimum, strict priorities, verified points, and the fallback ladder."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from problems import Hierarchy, kkt_violation, level_problem, quadratic, random_hierarchy, singular_hierarchy

from himpc import qp
from himpc.cascade.cascade import Route
from himpc.cascade.level import LevelProblem, LevelSolution
from himpc.cascade.null_space import RANK_TOLERANCE
from himpc.limits import Rows
from himpc.limits.rows import least_slack

Array = NDArray[np.float64]

seeds = st.integers(0, 2**32 - 1)
joints = st.integers(2, 9)
horizons = st.integers(1, 8)
depths = st.integers(1, 4)


def assert_sound(hierarchy: Hierarchy, solutions: list[LevelSolution], tolerance: float = 1e-6) -> None:
    """Every level solved its printed problem: KKT conditions, priorities and bounds."""
    above = np.zeros(hierarchy.shape)
    for level, solution in enumerate(solutions):
        assert solution.rung == "solve"
        assert solution.kkt_residual <= tolerance
        assert kkt_violation(hierarchy, level, solution, above) <= tolerance
        above = solution.U


def assert_within(rows: Rows, U: Array, tolerance: float = 1e-8) -> None:
    value = rows.L @ U
    assert (value <= rows.upper + tolerance).all()
    assert (value >= rows.lower - tolerance).all()


def largest_difference(one: list[LevelSolution], other: list[LevelSolution]) -> float:
    return max(float(np.abs(a.U - b.U).max()) for a, b in zip(one, other, strict=True))


@given(seeds, joints, horizons, depths, st.booleans(), st.sampled_from([1.0, 5.0, 30.0]))
@settings(max_examples=250)
def test_routes_agree(seed: int, n: int, N: int, levels: int, position_rows: bool, room: float) -> None:
    """The structured route solves every feasible hierarchy, and equals the explicit one to 1e-6 N·m."""
    hierarchy = random_hierarchy(seed, n, N, levels, position_rows, room)
    structured = hierarchy.solve("structured")
    assert_sound(hierarchy, structured)
    assert max(solution.leak for solution in structured) <= 1e-6
    explicit = hierarchy.solve("explicit")
    # The oracle must have an accurate point: DAQP refuses about one in a hundred of the large explicit QPs.
    assume(all(solution.rung == "solve" and solution.kkt_residual <= 1e-9 for solution in explicit))
    assert largest_difference(structured, explicit) <= 1e-6


def test_the_random_hierarchies_bind() -> None:
    """The property tests are about active bounds: most of their levels have some."""
    solutions = [s for seed in range(60) for s in random_hierarchy(seed, 6, 5, 3).solve()]
    share = np.mean([len(solution.active) > 0 for solution in solutions])
    assert share > 0.6


@given(seeds, st.integers(2, 7), st.integers(1, 5), st.integers(1, 3))
@settings(max_examples=60)
def test_proxqp_agrees_where_it_solves(seed: int, n: int, N: int, levels: int) -> None:
    """ProxQP on the explicit QPs finds the same increments wherever its point is accurate."""
    hierarchy = random_hierarchy(seed, n, N, levels)
    proxqp = hierarchy.solve("explicit", "proxqp")
    # A point passes at a scaled residual of 1e-6, which leaves more than 1e-6 N·m where H ≥ R is flat.
    for problem, solution in zip(hierarchy.problems, proxqp, strict=True):
        H, f = quadratic(problem)
        scale = max(1.0, float(np.linalg.norm(H) * np.linalg.norm(solution.U)), float(np.linalg.norm(f)))
        assume(solution.rung == "solve" and solution.kkt_residual * scale / problem.R.min() <= 1e-6)
    assert largest_difference(hierarchy.solve("structured"), proxqp) <= 1e-6


@given(seeds, joints, horizons, st.integers(2, 4))
@settings(max_examples=80)
def test_lower_levels_change_nothing_above(seed: int, n: int, N: int, levels: int) -> None:
    """Level 1's optimum, its cost and its acceleration B₁U are the same whatever follows it."""
    hierarchy = random_hierarchy(seed, n, N, levels)
    alone = Hierarchy(hierarchy.problems[:1], hierarchy.rows).solve()[0]
    solutions = hierarchy.solve()
    np.testing.assert_allclose(solutions[0].U, alone.U, atol=1e-9)
    for upper in range(levels):
        problem, mine = hierarchy.problems[upper], solutions[upper]
        last = solutions[-1].U
        wanted = np.einsum("jmn,jn->jm", problem.B, mine.U)
        got = np.einsum("jmn,jn->jm", problem.B, last)
        np.testing.assert_allclose(got, wanted, atol=1e-7)
        own = problem.knots
        effort = float(np.vdot(problem.R * mine.U[:own], mine.U[:own]))
        effort_last = float(np.vdot(problem.R * last[:own], last[:own]))
        residual = problem.cost(mine.U) - effort
        assert problem.cost(last) - effort_last == pytest.approx(residual, rel=1e-6, abs=1e-6)
        assert mine.cost == pytest.approx(problem.cost(mine.U), rel=1e-9)


decades = st.floats(-15, -12.001) | st.floats(-7.999, -2) | st.none()


@given(seeds, st.integers(2, 8), st.integers(1, 6), decades)
@settings(max_examples=120)
def test_routes_agree_on_rank_deficient_stacks(seed: int, n: int, N: int, decade: float | None) -> None:
    """A level that repeats another, exactly or nearly, keeps both routes equal away from the tolerance."""
    size = 0.0 if decade is None else 10**decade
    assert size < 0.01 * RANK_TOLERANCE or size > 100 * RANK_TOLERANCE
    hierarchy = singular_hierarchy(seed, n, N, size)
    structured, explicit = hierarchy.solve("structured"), hierarchy.solve("explicit")
    assert_sound(hierarchy, structured)
    assume(all(solution.rung == "solve" for solution in explicit))
    assert largest_difference(structured, explicit) <= 1e-6


@given(seeds, st.integers(2, 8), st.integers(1, 6), st.floats(-12, -8))
@settings(max_examples=80)
def test_near_the_rank_tolerance_points_are_still_sound(seed: int, n: int, N: int, decade: float) -> None:
    """Near the tolerance either reading of the rank is right; residual, leak and bounds hold."""
    hierarchy = singular_hierarchy(seed, n, N, 10**decade)
    for solution in hierarchy.solve():
        assert solution.rung == "solve"
        assert solution.kkt_residual <= 1e-6
        assert solution.leak <= 1e-6
        assert_within(hierarchy.rows, solution.U)


def test_no_freedom_left_keeps_the_upper_levels() -> None:
    """A level below a full stack has nothing to choose and changes nothing."""
    hierarchy = random_hierarchy(3, 4, 5, 1)
    everything = random_hierarchy(4, 4, 5, 1).problems[0]
    full = replace_rows(everything, np.random.default_rng(0).normal(0, 1, (5, 4, 4)))
    stack = Hierarchy([full, replace(hierarchy.problems[0], name="last")], hierarchy.rows)
    for route in ("structured", "explicit"):
        first, last = stack.solve(route)
        np.testing.assert_array_equal(first.U, last.U)
        assert (last.rung, last.status) == ("solve", "empty")


def replace_rows(problem: LevelProblem, B: Array) -> LevelProblem:
    N, m, n = B.shape
    C = np.repeat(problem.C[:, :1], m, axis=1)
    return level_problem("full", B, C, np.ones((N, m)), np.full(m, 100.0), np.full(n, 1.0))


@given(seeds, st.integers(2, 8), st.integers(1, 6), st.integers(1, 3))
@settings(max_examples=60)
def test_warm_starts_change_nothing(seed: int, n: int, N: int, levels: int) -> None:
    """What was active a tick ago only saves time: the optimum of the new problem is found all the same."""
    hierarchy = random_hierarchy(seed, n, N, levels)
    before = {solution.name: solution for solution in hierarchy.solve()}
    rng = np.random.default_rng(seed)
    moved = [replace(p, free=p.free + rng.normal(0, 3, p.free.shape)) for p in hierarchy.problems]
    changed = Hierarchy(moved, hierarchy.rows)
    warm = changed.solve(previous=before)
    assert_sound(changed, warm)
    assert largest_difference(warm, changed.solve()) <= 1e-6


def test_multipliers_tell_what_room_is_worth() -> None:
    """Twice a multiplier is what the level's cost would save per N·m of further room."""
    compared = 0
    for seed in range(12):
        hierarchy = random_hierarchy(seed, 5, 4, 1)
        solution = hierarchy.solve()[0]
        active = solution.active
        for row, joint, multiplier in zip(active.row, active.joint, active.multiplier, strict=True):
            if abs(multiplier) < 1e-2:
                continue
            room, size = 1e-5, np.zeros_like(hierarchy.rows.lower)
            size[row, joint] = room
            costs = []
            for sign in (1.0, -1.0):
                rows = hierarchy.rows
                if multiplier > 0:
                    rows = Rows(rows.L, rows.lower, rows.upper + sign * size, rows.kinds)
                else:
                    rows = Rows(rows.L, rows.lower - sign * size, rows.upper, rows.kinds)
                costs.append(Hierarchy(hierarchy.problems, rows).solve()[0].cost)
            saved = (costs[1] - costs[0]) / (2 * room)
            assert saved == pytest.approx(2 * abs(multiplier), rel=2e-2, abs=1e-2)
            compared += 1
    assert compared > 20


# ------------------------------------------------------------------ the ladder


def unreachable(hierarchy: Hierarchy, excess: float = 1.0) -> Hierarchy:
    """The hierarchy with a velocity bound at the first knot that no torque within its bounds can meet."""
    rows = hierarchy.rows
    N, n = hierarchy.shape
    lower, upper = rows.lower.copy(), rows.upper.copy()
    lower[:N], upper[:N] = -np.ones((N, n)), np.ones((N, n))
    # Every other bound is wide; joint 0 is asked for 1 + excess N·m where at most 1 N·m is to be had.
    lower[N:], upper[N:] = -1e3, 1e3
    lower[N, 0] = 1.0 + excess
    return Hierarchy(hierarchy.problems, Rows(rows.L, lower, upper, rows.kinds))


@pytest.mark.parametrize("route", ["structured", "explicit"])
@pytest.mark.parametrize("seed", range(6))
def test_infeasible_rows_are_softened_by_the_least(seed: int, route: Route) -> None:
    """State rows give way by what torque cannot do and no more; lower levels stay feasible (Theorem 2)."""
    hierarchy = unreachable(random_hierarchy(seed, 5, 4, 3))
    N, _ = hierarchy.shape
    solutions = hierarchy.solve(route)
    assert [solution.rung for solution in solutions] == ["soften", "solve", "solve"]
    for solution in solutions:
        value = hierarchy.rows.L @ solution.U
        assert value[N, 0] == pytest.approx(1.0, abs=1e-6)
        short = np.maximum(value - hierarchy.rows.upper, hierarchy.rows.lower - value)
        short[N, 0] = 0.0
        assert short.max() <= 1e-6
        assert solution.kkt_residual <= 1e-6
    assert max(solution.leak for solution in solutions) <= 1e-6


@pytest.mark.parametrize("seed", range(4))
def test_softened_routes_agree(seed: int) -> None:
    """Both routes soften by the same slack and then find the same increments."""
    hierarchy = unreachable(random_hierarchy(seed, 4, 3, 2))
    assert largest_difference(hierarchy.solve("structured"), hierarchy.solve("explicit")) <= 1e-6


def boxed(hierarchy: Hierarchy, past: float = 0.0) -> Hierarchy:
    """The hierarchy with one torque box for all knots; joint 0 is `past` N·m outside it now."""
    rows = hierarchy.rows
    N, _ = hierarchy.shape
    lower, upper = rows.lower.copy(), rows.upper.copy()
    size = np.minimum(np.abs(lower[:N]), np.abs(upper[:N])).min(axis=0)
    lower[:N], upper[:N] = -size, size
    upper[:N, 0], lower[:N, 0] = upper[:N, 0] - past, lower[:N, 0] - past
    return Hierarchy(hierarchy.problems, Rows(rows.L, lower, upper, rows.kinds))


NONSENSE = {
    "garbage": lambda f, A: (np.full(f.size, 1e3), np.zeros(len(A)), "optimal"),
    "nan": lambda f, A: (np.full(f.size, np.nan), np.full(len(A), np.nan), "optimal"),
    "infinite": lambda f, A: (np.full(f.size, np.inf), np.zeros(len(A)), "optimal"),
    "unsolved": lambda f, A: (np.zeros(f.size), np.zeros(len(A)), "daqp -4"),
}


def break_solver(monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    """Every QP solver answers nonsense, whatever it is asked, and calls it a solution."""

    def nonsense(H: Array, f: Array, A: Array, *_: Any, **__: Any) -> tuple[Array, Array, str]:
        return NONSENSE[kind](f, A)

    monkeypatch.setattr(qp, "_DAQP", (nonsense,))
    monkeypatch.setattr(qp, "_proxqp", nonsense)


@pytest.fixture(scope="module")
def pressed() -> Hierarchy:
    """Three levels whose bounds all bind, solved once in good health."""
    hierarchy = boxed(random_hierarchy(11, 5, 4, 3, room=0.3))
    assert len(hierarchy.solve()[0].active)
    return hierarchy


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("solver", ["daqp", "proxqp"])
@pytest.mark.parametrize("kind", NONSENSE)
def test_a_broken_solver_falls_to_the_previous_plan(
    monkeypatch: pytest.MonkeyPatch, pressed: Hierarchy, kind: str, solver: qp.Solver
) -> None:
    """Level 1 goes on with its shifted plan, lower levels inherit, and the torque rows hold."""
    previous = {s.name: replace(s, U=0.01 * s.U) for s in pressed.solve()}
    break_solver(monkeypatch, kind)
    solutions = pressed.solve("explicit", solver, previous)
    assert solutions[0].rung == "previous"
    assert {solution.rung for solution in solutions[1:]} <= {"inherit", "solve"}
    shifted = np.vstack([previous[solutions[0].name].U[1:], np.zeros((1, pressed.shape[1]))])
    np.testing.assert_array_equal(solutions[0].U, shifted)
    for solution in solutions:
        assert_within(pressed.rows.torque_only(), solution.U)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("kind", NONSENSE)
@pytest.mark.parametrize("route", ["structured", "explicit"])
def test_a_broken_solver_without_a_plan_damps_or_holds(
    monkeypatch: pytest.MonkeyPatch, pressed: Hierarchy, kind: str, route: Route
) -> None:
    """Without a previous plan the damping level is tried under torque rows, and at last the torque stays."""
    break_solver(monkeypatch, kind)
    solutions = pressed.solve(route)
    # The damping problem asks for nothing at rest; the structured route needs no solver for it.
    assert solutions[0].rung in ("damping", "hold")
    if route == "explicit" and kind in ("garbage", "nan", "infinite"):
        assert solutions[0].rung == "hold"
    for solution in solutions:
        assert np.isfinite(solution.U).all()
        assert_within(pressed.rows.torque_only(), solution.U)
        np.testing.assert_array_equal(solution.U, solutions[0].U)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_level_whose_solver_fails_inherits(monkeypatch: pytest.MonkeyPatch) -> None:
    """When only a lower level fails it keeps the increments of the level above, and says so."""
    hierarchy = random_hierarchy(11, 6, 4, 3, room=0.3)
    sound = hierarchy.solve()
    assert all(len(solution.active) for solution in sound[:2])
    healthy, calls = qp._DAQP, []

    def fails_below(H: Array, f: Array, A: Array, lower: Array, upper: Array, **options: float) -> Any:
        calls.append(len(f))
        if len(f) < max(calls):
            return np.full(f.size, np.nan), np.zeros(len(A)), "optimal"
        return healthy[0](H, f, A, lower, upper)

    monkeypatch.setattr(qp, "_DAQP", (fails_below,))
    solutions = hierarchy.solve()
    np.testing.assert_array_equal(solutions[0].U, sound[0].U)
    assert [solution.rung for solution in solutions][:2] == ["solve", "inherit"]
    np.testing.assert_array_equal(solutions[1].U, solutions[0].U)
    for solution in solutions:
        assert_within(hierarchy.rows, solution.U)


@given(seeds, st.integers(1, 6), st.integers(1, 5), st.booleans())
@settings(max_examples=60)
def test_whatever_the_rows_the_torque_rows_hold(seed: int, n: int, N: int, position_rows: bool) -> None:
    """Random, mostly contradictory state rows: some rung answers, finite, within torque, no level leaks."""
    hierarchy = random_hierarchy(seed, max(n, 2), N, 3, position_rows)
    rng = np.random.default_rng(seed)
    rows = hierarchy.rows
    shift = np.where(np.arange(len(rows.L)) < N, 0.0, 1.0)[:, None] * rng.normal(0, 50, rows.lower.shape)
    shifted = Rows(rows.L, rows.lower + shift, rows.upper + shift, rows.kinds)
    contradictory = boxed(Hierarchy(hierarchy.problems, shifted), past=float(rng.choice([0.0, 0.3])))
    solutions = contradictory.solve()
    assert solutions[0].rung in ("solve", "soften", "damping", "hold")
    for solution in solutions:
        assert np.isfinite(solution.U).all()
        assert solution.kkt_residual <= 1e-6
        assert solution.leak <= 1e-6
        assert_within(contradictory.rows.torque_only(), solution.U)


@given(seeds, st.integers(1, 6), st.integers(1, 6), st.booleans())
@settings(max_examples=60)
def test_least_slack_makes_any_rows_feasible(seed: int, n: int, N: int, position_rows: bool) -> None:
    """Rows widened by the least slack always admit a point within the torque rows."""
    hierarchy = random_hierarchy(seed, max(n, 2), N, 1, position_rows)
    rng = np.random.default_rng(seed)
    rows = hierarchy.rows
    shift = np.where(np.arange(len(rows.L)) < N, 0.0, 1.0)[:, None] * rng.normal(0, 20, rows.lower.shape)
    shifted = Rows(rows.L, rows.lower + shift, rows.upper + shift, rows.kinds)
    slack = least_slack(shifted)
    assert (slack >= 0).all()
    assert not slack[:N].any()
    assert feasible(shifted.widened(slack + 1e-9 * (slack > 0)))


def feasible(rows: Rows) -> bool:
    """Whether some increments meet all rows, by linear programming joint by joint."""
    from scipy.optimize import linprog

    N = rows.L.shape[1]
    for joint in range(rows.lower.shape[1]):
        lower, upper = rows.lower[:, joint], rows.upper[:, joint]
        A = np.vstack([rows.L[np.isfinite(upper)], -rows.L[np.isfinite(lower)]])
        b = np.concatenate([upper[np.isfinite(upper)], -lower[np.isfinite(lower)]]) + 1e-7
        if not linprog(np.zeros(N), A_ub=A, b_ub=b, bounds=(None, None), method="highs").success:
            return False
    return True
