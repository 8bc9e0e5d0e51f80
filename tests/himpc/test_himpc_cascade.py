"""The kernel and the printed equations give the same optimum, priorities are strict, and every point is
verified."""

from __future__ import annotations

import numpy as np
import pytest
from cascade_checks import (
    assert_agree,
    assert_sound,
    assert_within,
    exact_increments,
    largest_difference,
    off,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from problems import Hierarchy, level_problem, quadratic, random_hierarchy, shifted, singular_hierarchy

from himpc.cascade.level import LevelProblem, LevelSolution
from himpc.constants import RANK_TOLERANCE
from himpc.limits import Rows
from himpc.qp import is_installed
from himpc.tick.fallbacks import solve_level
from himpc.tick.kernel.goldfarb_idnani import TOLERANCE
from himpc.tick.problems import arena_of

Array = NDArray[np.float64]

seeds = st.integers(0, 2**32 - 1)
joints = st.integers(2, 9)
horizons = st.integers(1, 8)
depths = st.integers(1, 4)


@given(seeds, joints, horizons, depths, st.booleans(), st.sampled_from([1.0, 5.0, 30.0]))
@settings(max_examples=250)
def test_kernel_and_printed_equations_agree(
    seed: int, n: int, N: int, levels: int, position_rows: bool, room: float
) -> None:
    """The kernel solves every feasible hierarchy: its point is within 1e-7 N·m of the exact optimum of the
    printed equations. The printed equations in doubles are no reference here: of 2,995 such stacks their own
    solver was off by more than 1e-6 N·m in 21, and the kernel by 3e-9 at most."""
    hierarchy = random_hierarchy(seed, n, N, levels, position_rows, room)
    compiled = hierarchy.solve("compiled")
    assert_sound(hierarchy, compiled)
    assert max(solution.leak for solution in compiled) <= 1e-6
    assert off(compiled, exact_increments(hierarchy, compiled, hierarchy.solve("printed"))) <= 1e-7


def test_the_random_hierarchies_bind() -> None:
    """The random hierarchies of these tests have active bounds at most of their levels."""
    solutions = [s for seed in range(60) for s in random_hierarchy(seed, 6, 5, 3).solve()]
    share = np.mean([len(solution.active) > 0 for solution in solutions])
    assert share > 0.6


def test_proxqp_agrees_where_it_solves() -> None:
    """ProxQP finds the same increments on the printed QPs if its point is accurate, which is the case for
    about one in eight of these stacks."""
    compared = 0
    for seed in range(200):
        n, N, levels = np.random.default_rng(seed).integers((2, 1, 1), (8, 6, 4)).tolist()
        hierarchy = random_hierarchy(seed, n, N, levels)
        proxqp = hierarchy.solve("printed", "proxqp")
        if all(accurate(problem, found) for problem, found in zip(hierarchy.problems, proxqp, strict=True)):
            compared += 1
            assert_agree(hierarchy.solve("compiled"), proxqp)
    assert compared >= 10


def accurate(problem: LevelProblem, solution: LevelSolution) -> bool:
    """Whether a point is accurate: the tolerance of 1e-6 for the scaled residual allows errors of more than
    1e-6 N·m where H ≥ R is flat."""
    H, f = quadratic(problem)
    scale = max(1.0, float(np.linalg.norm(H) * np.linalg.norm(solution.U)), float(np.linalg.norm(f)))
    return solution.fallback == "solve" and solution.kkt_residual * scale / problem.R.min() <= 1e-6


@pytest.mark.skipif(not is_installed("qpoases"), reason="CasADi, which brings qpOASES, is not installed")
@pytest.mark.parametrize("seed", range(8))
def test_qpoases_agrees(seed: int) -> None:
    """qpOASES, the paper's own solver, finds the same increments on the printed QPs."""
    hierarchy = random_hierarchy(seed, 5, 4, 3)
    qpoases = hierarchy.solve("printed", "qpoases")
    assert all(solution.fallback == "solve" for solution in qpoases)
    assert_agree(hierarchy.solve("compiled"), qpoases)


@given(seeds, joints, horizons, st.integers(2, 4))
@settings(max_examples=80)
def test_lower_levels_change_nothing_above(seed: int, n: int, N: int, levels: int) -> None:
    """The optimum of level 1, its cost and its acceleration B₁U do not depend on the levels below."""
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
def test_both_agree_on_rank_deficient_stacks(seed: int, n: int, N: int, decade: float | None) -> None:
    """If a level repeats another, exactly or nearly, both are equal, except near the rank tolerance.

    A direction of relative size s is known with an accuracy of rounding divided by s, and this limits the
    accuracy of lower levels. With s = 1.3e-8 an earlier printed solver was 2.8e-6 N·m and the kernel 8e-8 N·m
    from the optimum that was computed with 300 bits.
    """
    size = 0.0 if decade is None else 10**decade
    assert size < 0.01 * RANK_TOLERANCE or size > 100 * RANK_TOLERANCE
    hierarchy = singular_hierarchy(seed, n, N, size)
    compiled, printed = hierarchy.solve("compiled"), hierarchy.solve("printed")
    assert_sound(hierarchy, compiled)
    assert all(solution.fallback == "solve" for solution in printed)
    rounding = 1e3 * np.finfo(float).eps / size if size > RANK_TOLERANCE else 0.0
    assert largest_difference(compiled, printed) <= max(1e-6, rounding)


@given(seeds, st.integers(2, 8), st.integers(1, 6), st.floats(-12, -8))
@settings(max_examples=80)
def test_near_the_rank_tolerance_points_are_still_sound(seed: int, n: int, N: int, decade: float) -> None:
    """Near the rank tolerance, either rank is acceptable; residual, leak and bounds hold."""
    hierarchy = singular_hierarchy(seed, n, N, 10**decade)
    for solution in hierarchy.solve():
        assert solution.fallback == "solve"
        assert solution.kkt_residual <= 1e-6
        assert solution.leak <= 1e-6
        assert_within(hierarchy.rows, solution.U)


def test_no_freedom_left_keeps_the_upper_levels() -> None:
    """If the levels above use all freedom, a level changes nothing."""
    hierarchy = random_hierarchy(3, 4, 5, 1)
    everything = random_hierarchy(4, 4, 5, 1).problems[0]
    full = replace_rows(everything, np.random.default_rng(0).normal(0, 1, (5, 4, 4)))
    stack = Hierarchy([full, hierarchy.problems[0]._replace(name="last")], hierarchy.rows)
    for by in ("compiled", "printed"):
        first, last = stack.solve(by)
        np.testing.assert_array_equal(first.U, last.U)
        assert (last.fallback, last.status) == ("solve", "empty")


def replace_rows(problem: LevelProblem, B: Array) -> LevelProblem:
    N, m, n = B.shape
    C = np.repeat(problem.C[:, :1], m, axis=1)
    return level_problem("full", B, C, np.ones((N, m)), np.full(m, 100.0), np.full(n, 1.0))


@given(seeds, st.integers(2, 8), st.integers(1, 6), st.integers(1, 3))
@settings(max_examples=60)
def test_warm_starts_change_nothing(seed: int, n: int, N: int, levels: int) -> None:
    """The active set of the previous tick only saves time; the solver finds the same optimum of the new
    problem."""
    hierarchy = random_hierarchy(seed, n, N, levels)
    before = {solution.name: solution for solution in hierarchy.solve()}
    changed = with_other_errors(hierarchy, seed)
    warm = changed.solve(previous=before)
    assert_sound(changed, warm)
    assert largest_difference(warm, changed.solve()) <= 1e-6


@pytest.mark.parametrize(
    ("seed", "n", "N", "levels"),
    [(161, 7, 6, 2), (29, 8, 6, 2), (17, 7, 6, 2), (98, 8, 6, 2), (75, 8, 6, 2), (26, 8, 6, 3)],
)
def test_corners_that_many_bounds_make_are_found(seed: int, n: int, N: int, levels: int) -> None:
    """If active bounds use nearly all freedom, rounding errors can make a feasible bound look infeasible."""
    hierarchy = with_other_errors(random_hierarchy(seed, n, N, levels), seed)
    found = hierarchy.solve()
    assert_sound(hierarchy, found)
    assert max(len(solution.active) for solution in found) >= 25
    printed = hierarchy.solve("printed")
    exact = exact_increments(hierarchy, found, printed)
    assert off(found, exact) <= 1e-6
    assert off(printed, exact) <= 1e-6


@pytest.mark.parametrize("seed", range(20))
def test_a_level_that_is_tried_once_more_still_follows_its_own_tasks(seed: int) -> None:
    hierarchy = random_hierarchy(seed, 6, 4, 3)
    arena = arena_of(hierarchy.problems, hierarchy.rows, {})
    for place in range(3):
        assert solve_level(arena, place)
        first = arena.f["U"][place].copy()
        if place:
            assert solve_level(arena, place, TOLERANCE)
            assert np.abs(arena.f["U"][place] - first).max() <= 1e-4
            arena.f["U"][place] = first


def with_other_errors(hierarchy: Hierarchy, seed: int) -> Hierarchy:
    """Returns the same hierarchy with different free residuals."""
    rng = np.random.default_rng(seed)
    moved = [shifted(p, rng.normal(0, 3, p.free.shape)) for p in hierarchy.problems]
    return Hierarchy(moved, hierarchy.rows)


def test_multipliers_tell_what_room_is_worth() -> None:
    """Twice a multiplier is the decrease of the cost of the level per N·m by which the bound is relaxed."""
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
                    rows = Rows(rows.L, rows.lower, rows.upper + sign * size, rows.constraints)
                else:
                    rows = Rows(rows.L, rows.lower - sign * size, rows.upper, rows.constraints)
                costs.append(Hierarchy(hierarchy.problems, rows).solve()[0].cost)
            saved = (costs[1] - costs[0]) / (2 * room)
            assert saved == pytest.approx(2 * abs(multiplier), rel=2e-2, abs=1e-2)
            compared += 1
    assert compared > 20
