"""The kernel and the printed equations solve constraints whose directions combine several joints, and report
which of them are active."""

from __future__ import annotations

import numpy as np
import pytest
from cascade_checks import largest_difference
from numpy.typing import NDArray
from problems import Hierarchy, equalities, quadratic, random_hierarchy

from himpc.cascade.level import LevelSolution
from himpc.limits import CONSTRAINTS, Rows
from himpc.limits.constraint import Block, Constraint, Directions, Moment
from himpc.limits.constraints import bit_of
from himpc.limits.velocity import summed_twice
from himpc.qp import solve_qp

Array = NDArray[np.float64]


def _no_bounds(now: Moment) -> Block:
    raise AssertionError(f"given by hand, not at {now}")


COUPLED = Constraint(
    "coupled", summed_twice, first_knot=1, hard=False, is_on=lambda _: False, bounds=_no_bounds
)
"""A constraint on sums over several joints of the quantity that a velocity row bounds for a single joint."""


def coupled(seed: int, n: int, N: int, levels: int, room: float = 0.3) -> Hierarchy:
    """Returns a random hierarchy with two more directions, each of which contains all joints. Their bounds
    are around a point that satisfies all other rows; the remaining columns are not used."""
    hierarchy = random_hierarchy(seed, n, N, levels, even=True)
    rng, rows = np.random.default_rng(seed), hierarchy.rows
    D = np.zeros((n, n))
    D[:2] = rng.normal(0, 1, (2, n))
    D[:2] /= np.linalg.norm(D[:2], axis=1, keepdims=True)
    inside = inside_of(rows)
    wanted = hierarchy.solve("printed")[-1].U
    at, reach = (summed_twice(N) @ U @ D.T for U in (inside, wanted))
    margin = room * np.abs(reach - at) + 1e-3
    lower, upper = np.full((N, n), -np.inf), np.full((N, n), np.inf)
    lower[:, :2], upper[:, :2] = (at - margin)[:, :2], (at + margin)[:, :2]
    names = ("one", "other", *("",) * (n - 2))
    return Hierarchy(
        hierarchy.problems,
        Rows(
            np.vstack([rows.L, summed_twice(N)]),
            np.vstack([rows.lower, lower]),
            np.vstack([rows.upper, upper]),
            (*rows.constraints, COUPLED),
            directions=(*(None,) * len(rows.constraints), Directions(D, names)),
        ),
    )


def inside_of(rows: Rows) -> Array:
    """Returns the increments of least norm that satisfy all rows, (N, n)."""
    N, n = rows.L.shape[1], rows.lower.shape[1]
    A, lower, upper = rows.matrix, rows.lower.ravel(), rows.upper.ravel()
    found = solve_qp(np.eye(N * n), np.zeros(N * n), A, lower, upper)
    assert found.solved
    return found.x.reshape(N, n)


def active(level: LevelSolution) -> set[tuple[int, int]]:
    """Returns the rows and columns that are active."""
    return set(zip(level.active.row.tolist(), level.active.joint.tolist(), strict=True))


@pytest.mark.parametrize("seed", range(8))
def test_both_and_a_plain_qp_agree_on_coupled_rows(seed: int) -> None:
    """The optimum of each level is that of the complete QP, with (33) as equalities and all rows one by one.
    Some coupled row is active; without one, the increments would not depend on the coupled rows."""
    n, N, levels = 3 + seed % 4, 1 + seed % 5, 1 + seed % 3
    hierarchy = coupled(seed, n, N, levels)
    compiled, printed = hierarchy.solve("compiled"), hierarchy.solve("printed")
    assert {each.fallback for each in (*compiled, *printed)} == {"solve"}
    assert largest_difference(compiled, printed) <= 1e-8
    rows, own = hierarchy.rows, (len(hierarchy.rows.constraints) - 1) * N
    assert any((level.active.row >= own).any() for level in compiled)
    assert active(compiled[0]) == active(printed[0])
    A = np.array([rows.values(unit.reshape(N, n)).ravel() for unit in np.eye(N * n)]).T
    above = np.zeros(N * n)
    for level, problem in enumerate(hierarchy.problems):
        E = equalities(hierarchy.problems, level)
        lower, upper = rows.lower.ravel(), rows.upper.ravel()
        if level:
            lower, upper = np.minimum(lower, A @ above), np.maximum(upper, A @ above)
        found = above + least(*quadratic(problem), A, lower, upper, E, above)
        assert np.abs(found - compiled[level].U.ravel()).max() <= 1e-6
        above = compiled[level].U.ravel()


def least(H: Array, f: Array, A: Array, lower: Array, upper: Array, E: Array, above: Array) -> Array:
    """Returns the step from `above` to the minimum of ½UᵀHU + fᵀU, with E U unchanged and A U between its
    bounds."""
    free = np.linalg.svd(E)[2][len(E) :].T if len(E) else np.eye(len(H))
    if not free.shape[1]:
        return np.zeros_like(above)
    P = np.linalg.solve(np.linalg.cholesky(free.T @ H @ free), free.T).T
    length = np.linalg.norm(A @ P, axis=1)
    felt = length > 1e-9 * length.max()
    rows, length, at = (A @ P)[felt] / length[felt, None], length[felt], (A @ above)[felt]
    c = P.T @ (H @ above + f)
    found = solve_qp(np.eye(c.size), c, rows, (lower[felt] - at) / length, (upper[felt] - at) / length)
    return P @ found.x


@pytest.mark.parametrize("seed", range(3))
def test_an_active_coupled_row_says_its_name(seed: int) -> None:
    """The evidence contains the label, the name of the direction and the knot, and the joints that the row
    bounds."""
    hierarchy = coupled(seed, 4, 3, 1, room=0.05)
    rows = hierarchy.rows
    (solution,) = hierarchy.solve()
    told = [each for each in solution.active.labelled(rows, ("a", "b", "c", "d")) if each[0] == "coupled"]
    assert told and {name for _, _, name, _, _ in told} <= {"one", "other"}
    assert all(1 <= knot <= 3 for _, knot, *_ in told)
    assert rows.joints_of(len(rows.L) - 1, 0) == (0, 1, 2, 3)
    assert rows.joints_of(0, 2) == (2,)


def test_every_constraint_has_a_bit_and_a_label_of_its_own() -> None:
    """Bits and labels are unique; otherwise two active constraints could not be distinguished."""
    assert [bit_of(each) for each in CONSTRAINTS] == [1 << place for place in range(len(CONSTRAINTS))]
    assert len({each.label for each in CONSTRAINTS}) == len(CONSTRAINTS)
    assert bit_of(COUPLED) == 0
