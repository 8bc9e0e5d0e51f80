"""The fast route: where it applies it finds the same optimum, and where it does not it says so."""

from __future__ import annotations

import numpy as np
import pytest
from cascade_checks import assert_agree, assert_sound
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from problems import Hierarchy, random_hierarchy, shifted, singular_hierarchy

from himpc.cascade import bases, cascade, kernel
from himpc.cascade.level import NO_ROWS, ActiveRows
from himpc.cascade.triangular import solve_triangular

seeds = st.integers(0, 2**32 - 1)


def leading(hierarchy: Hierarchy, warm: list[ActiveRows]) -> int:
    """How many levels the fast route solves."""
    problems = hierarchy.problems
    N, n = hierarchy.shape
    B = np.concatenate([np.empty((N, 0, n)), *(problem.B for problem in problems[:-1])], axis=1)
    return len(solve_triangular(problems, B, hierarchy.rows, warm))


def a_tick_later(hierarchy: Hierarchy, seed: int) -> Hierarchy:
    rng = np.random.default_rng(seed)
    return Hierarchy(
        [shifted(p, rng.normal(0, 1e-3, p.free.shape)) for p in hierarchy.problems], hierarchy.rows
    )


@given(seeds, st.integers(2, 9), st.integers(1, 8), st.integers(1, 4), st.sampled_from([1.0, 5.0, 30.0]))
@settings(max_examples=150)
def test_the_next_tick_has_the_printed_optimum(seed: int, n: int, N: int, levels: int, room: float) -> None:
    """With last tick's active rows the optimum meets the literal KKT conditions and the explicit route."""
    hierarchy = random_hierarchy(seed, n, N, levels, room=room, even=True)
    before = {solution.name: solution for solution in hierarchy.solve()}
    later = a_tick_later(hierarchy, seed)
    solutions = later.solve(previous=before)
    assert_sound(later, solutions)
    explicit = later.solve("explicit")
    assume(all(solution.rung == "solve" and solution.kkt_residual <= 1e-9 for solution in explicit))
    assert_agree(solutions, explicit)


@pytest.mark.parametrize("room", [1.0, 1e3])
def test_the_fast_route_is_the_one_that_runs(room: float) -> None:
    """Most ticks, with or without active rows, need no other route."""
    solved, levels, bound = 0, 0, 0
    for seed in range(80):
        hierarchy = random_hierarchy(seed, 7, 5, 3, room=room, even=True)
        warm = [solution.active for solution in hierarchy.solve()]
        later = a_tick_later(hierarchy, seed)
        solved += leading(later, warm)
        levels += len(later.problems)
        bound += sum(len(active) > 0 for active in warm)
    assert solved > (0.55 if room == 1.0 else 0.9) * levels
    assert (bound > 0.8 * levels) if room == 1.0 else (bound < 0.3 * levels)


def test_wrong_rows_and_singular_levels_are_left_to_the_others() -> None:
    """Rows that must become free, and levels that repeat each other, end the list of points."""
    hierarchy = next(
        found
        for found in (random_hierarchy(seed, 6, 4, 2, even=True) for seed in range(50))
        if len(found.solve()[0].active)
    )
    active = hierarchy.solve()[0].active
    wrong = ActiveRows(active.row, active.joint, -active.multiplier, active.slack)
    assert leading(hierarchy, [wrong, NO_ROWS]) == 0
    singular = singular_hierarchy(3, 6, 4, 1e-12)
    even = [problem._replace(common_R=1.0, R=np.ones(6)) for problem in singular.problems]
    assert leading(Hierarchy(even, singular.rows), [NO_ROWS] * 3) == 0


def test_the_optimum_does_not_depend_on_the_fast_route(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without it the increments are the same to rounding."""
    for seed in range(20):
        hierarchy = random_hierarchy(seed, 7, 6, 3, even=True)
        fast = hierarchy.solve(previous={s.name: s for s in hierarchy.solve()})
        with monkeypatch.context() as patched:
            patched.setattr(cascade, "solve_triangular", lambda *_: [])
            assert_agree(fast, hierarchy.solve(), 1e-7)


def test_slices_are_taken_and_nothing_is_compiled_while_a_robot_moves() -> None:
    """However the arrays lie in memory the points are the same, from what was compiled at import."""
    hierarchy = random_hierarchy(4, 7, 5, 3, room=1.0, even=True)
    warm = [solution.active for solution in hierarchy.solve()]
    assert any(len(active) for active in warm)
    problems = [
        p._replace(
            B=_sliced(p.B), weighted_C=_sliced(p.weighted_C), weighted_free=np.asfortranarray(p.weighted_free)
        )
        for p in hierarchy.problems
    ]
    rows = hierarchy.rows._replace(lower=_sliced(hierarchy.rows.lower), upper=_sliced(hierarchy.rows.upper))
    slices = [
        ActiveRows(*map(_sliced, (active.row, active.joint, active.multiplier, active.slack)))
        for active in warm
    ]
    B = np.concatenate([problem.B for problem in problems[:-1]], axis=1)
    points = solve_triangular(hierarchy.problems, B, hierarchy.rows, warm)
    assert points
    for point, other in zip(points, solve_triangular(problems, _sliced(B), rows, slices), strict=True):
        np.testing.assert_array_equal(point.U, other.U)
    for compiled in (bases.orthogonal_bases, kernel.level_optimum, kernel.room_left):
        assert len(compiled.signatures) == 1


def _sliced(array: np.ndarray) -> np.ndarray:
    """The same numbers, not contiguous."""
    return np.repeat(array, 2, axis=-1)[..., ::2]
