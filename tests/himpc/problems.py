"""Random hierarchies for the tests of the cascade, and an independent implementation of (31)–(34)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import LevelProblem, LevelSolution
from himpc.controllers.printed_tick import solve
from himpc.limits import POSITION, TORQUE, VELOCITY, Rows
from himpc.limits.constraint import Constraint
from himpc.prediction import residual_model
from himpc.qp import Solver
from himpc.tick.problems import solve_problems

Array = NDArray[np.float64]


def level_problem(
    name: str, B: Array, C: Array, free: Array, Q: Array, R: Array, knots: int | None = None
) -> LevelProblem:
    """Returns the data of a level, computed from its weights as the paper prints them."""
    return LevelProblem(
        name=name,
        B=B,
        C=C,
        free=free,
        root_Q=np.sqrt(Q),
        R=R,
        knots=len(B) if knots is None else knots,
    )


def shifted(problem: LevelProblem, change: Array) -> LevelProblem:
    """Returns the same level with a different free residual."""
    return problem._replace(free=problem.free + change)


@dataclass(frozen=True, eq=False)
class Hierarchy:
    """Problems 1 … r and their bounds."""

    problems: list[LevelProblem]
    rows: Rows

    def solve(
        self,
        by: Literal["compiled", "printed"] = "compiled",
        solver: Solver = "daqp",
        previous: dict[str, LevelSolution] | None = None,
    ) -> list[LevelSolution]:
        """Solves the levels by the kernel, or by the equations of the controller himpc_printed."""
        if by == "compiled":
            return solve_problems(self.problems, self.rows, previous or {})
        return solve(self.problems, self.rows.matrix, self.rows, previous or {}, solver)

    @property
    def shape(self) -> tuple[int, int]:
        N, _, n = self.problems[0].B.shape
        return N, n


def row_blocks(N: int, constraints: Sequence[Constraint]) -> Array:
    """Returns the coefficients of the increments for torque, velocity and position: sums, sums of sums, and
    so on."""
    torque = np.tril(np.ones((N, N)))
    velocity = torque @ torque
    position = np.vstack([np.zeros((1, N)), (torque @ velocity)[:-1]]) if N > 1 else np.zeros((1, 1))
    # In the printed Euler step, q at knot j+1 contains the velocity up to knot j.
    own = {TORQUE: torque, VELOCITY: velocity, POSITION: position}
    return np.vstack([own[constraint] for constraint in constraints])


def random_hierarchy(
    seed: int, n: int, N: int, levels: int, position_rows: bool = False, room: float = 1.0, even: bool = False
) -> Hierarchy:
    """Returns regular levels, with M̄ over several decades, and feasible bounds of which some are active.

    room: the width of the bounds, relative to the motion of the levels without bounds.
    even: whether all joints of a level have the same R, and all levels the same horizon.
    """
    rng = np.random.default_rng(seed)
    M_bar = 10 ** rng.uniform(-3.0, 0.0, n)
    scalar_R = rng.random() < 0.5 or even
    problems = []
    for place in range(levels):
        m = int(rng.integers(1, min(4, n) + 1))
        J = rng.normal(0, 1, (m, n)) + 0.03 * rng.normal(0, 1, (N, m, n))
        C = residual_model(rng.uniform(0, 400, m), rng.uniform(0, 40, m), N, 1e-3).C
        R = np.full(n, 10 ** rng.uniform(0, 2)) if scalar_R else 10 ** rng.uniform(0, 2, n)
        knots = int(rng.integers(1, N + 1)) if rng.random() < 0.3 and not even else N
        free = rng.normal(0, 10, (N, m))
        problems.append(
            level_problem(f"level{place}", J / M_bar, C, free, 10 ** rng.uniform(0, 2.5, m), R, knots)
        )
    constraints = (TORQUE, VELOCITY, POSITION) if position_rows else (TORQUE, VELOCITY)
    bare = Rows(row_blocks(N, constraints), np.empty(0), np.empty(0), constraints)
    rows = bounds_around(rng, problems, bare, room)
    return Hierarchy(problems, rows)


def bounds_around(rng: np.random.Generator, problems: list[LevelProblem], rows: Rows, room: float) -> Rows:
    """Returns bounds in proportion to the increments of the levels without bounds; a point is strictly inside
    them."""
    N, _, n = problems[0].B.shape
    reach = sum(np.abs(unbounded_optimum(problem)) for problem in problems) + 1e-3
    inside = 0.3 * rng.normal(0, 1, (N, n)) * reach
    # a point beyond the horizon of level 1 must not require increments, because level 1 has none there
    inside[problems[0].knots :] = 0.0
    size = rows.L @ reach + 1e-3
    margin = [10 ** rng.uniform(-1.5, 0.5, size.shape) * size * room for _ in range(2)]
    lower, upper = rows.L @ inside - margin[0], rows.L @ inside + margin[1]
    free = rng.random(size.shape) < 0.1
    return Rows(rows.L, np.where(free, -np.inf, lower), np.where(free, np.inf, upper), rows.constraints)


def quadratic(problem: LevelProblem) -> tuple[Array, Array]:
    """Returns H and f of ½UᵀHU + fᵀU, which is half of (32a), summed literally over the knots."""
    N, m, n = problem.B.shape
    H, f = np.zeros((N * n, N * n)), np.zeros(N * n)
    Q = np.diag(problem.root_Q**2)
    for j in range(problem.knots):
        effect = np.zeros((m, N * n))
        for s in range(j + 1):
            effect[:, s * n : (s + 1) * n] = np.diag(problem.C[j, :, s]) @ problem.B[s]
        H += effect.T @ Q @ effect
        f += effect.T @ Q @ problem.free[j]
        H[j * n : (j + 1) * n, j * n : (j + 1) * n] += np.diag(problem.R)
    return H, f


def unbounded_optimum(problem: LevelProblem) -> Array:
    """Returns the increments of the level if it is solved alone and without bounds."""
    H, f = quadratic(problem)
    N, _, n = problem.B.shape
    used = problem.knots * n
    U = np.zeros(N * n)
    U[:used] = -np.linalg.solve(H[:used, :used], f[:used])
    return U.reshape(N, n)


def equalities(problems: Sequence[LevelProblem], level: int) -> Array:
    """Returns orthonormal rows, (k, N·n), that span the equalities (33) of a level and those for the knots
    beyond its horizon."""
    N, _, n = problems[0].B.shape
    blocks = []
    for j in range(N):
        if j >= problems[level].knots:
            fixed = np.eye(n)
        else:
            scaled = [p.B[j] / np.linalg.norm(p.B[j]) for p in problems[:level]]
            fixed = row_space(np.vstack([np.empty((0, n)), *scaled]))
        block = np.zeros((len(fixed), N, n))
        block[:, j] = fixed
        blocks.append(block.reshape(len(fixed), N * n))
    return np.vstack(blocks)


def row_space(A: Array, tolerance: float = 1e-9) -> Array:
    """Returns orthonormal rows that span the rows of A."""
    if not A.size:
        return A
    _, singular, Vt = np.linalg.svd(A)
    return Vt[: int((singular > tolerance).sum())]


def kkt_violation(
    hierarchy: Hierarchy, level: int, solution: LevelSolution, U_above: Array, rows: Rows | None = None
) -> float:
    """Returns the largest violation of the KKT conditions of Problem i in the full space of U, scaled as
    documented.

    It is computed from the literal H, f, bounds and equality rows. The multipliers of the bounds are the
    reported ones; those of the equalities are chosen such that the violation is smallest.
    """
    problem, rows = hierarchy.problems[level], rows or hierarchy.rows
    H, f = quadratic(problem)
    U = solution.U.ravel()
    multipliers = np.zeros(rows.lower.shape)
    multipliers[solution.active.row, solution.active.joint] = solution.active.multiplier
    gradient = H @ U + f + (rows.L.T @ multipliers).ravel()
    E = equalities(hierarchy.problems, level)
    gradient -= E.T @ (E @ gradient)
    scale = max(1.0, float(np.linalg.norm(H) * np.linalg.norm(U)), float(np.linalg.norm(f)))
    value = rows.L @ solution.U
    outside = np.maximum(value - rows.upper, rows.lower - value).max()
    gap = np.where(multipliers > 0, rows.upper - value, value - rows.lower)
    pressing = multipliers != 0
    complementarity = float(np.abs(multipliers[pressing] * gap[pressing]).max(initial=0.0)) / scale
    moved = float(np.abs(E @ (U - U_above.ravel())).max(initial=0.0))
    return max(float(np.abs(gradient).max()) / scale, float(outside), complementarity, moved)


def singular_hierarchy(seed: int, n: int, N: int, size: float) -> Hierarchy:
    """Returns three levels, the second of which repeats the first except for one direction of relative size
    `size`.

    The third level controls all joints, so it uses all directions that the second leaves free. With size 0
    the second level adds no direction.
    """
    rng = np.random.default_rng(seed)
    m = int(rng.integers(1, n))
    first = rng.normal(0, 1, (m, n)) + 0.03 * rng.normal(0, 1, (N, m, n))
    second = first.copy()
    own = rng.normal(0, 1, n)
    for j in range(N):
        space = row_space(first[j])
        away = own - space.T @ (space @ own)
        second[j, 0] += size * np.linalg.norm(first[j]) * away / np.linalg.norm(away)
    problems = []
    for place, B in enumerate((first, second, np.tile(np.eye(n), (N, 1, 1)))):
        rows = B.shape[1]
        C = residual_model(rng.uniform(0, 400, rows), rng.uniform(0, 40, rows), N, 1e-3).C
        free, Q, R = rng.normal(0, 10, (N, rows)), 10 ** rng.uniform(1, 2, rows), 10 ** rng.uniform(0, 1, n)
        problems.append(level_problem(f"level{place}", 20.0 * B, C, free, Q, R))
    constraints = (TORQUE, VELOCITY)
    bare = Rows(row_blocks(N, constraints), np.empty(0), np.empty(0), constraints)
    rows = bounds_around(rng, problems, bare, 3.0)
    return Hierarchy(problems, rows)
