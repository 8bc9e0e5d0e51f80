"""SQPSolve of Algorithm 2: Gauss-Newton QPs on STMPC (9), each followed by the tolerant line search (13)."""

from __future__ import annotations

from time import perf_counter_ns
from typing import NamedTuple

import numpy as np

from himpc.htmpc.active_set import CONTRADICTION
from himpc.htmpc.clearance import PENALTY
from himpc.htmpc.problem import Iterate, Problem
from himpc.htmpc.rows import ConstraintRows
from himpc.qp import QPSolution, solve_qp
from robots.arrays import Array

SHRINK = 0.5
"""β of the backtracking line search (the HTMPC authors' value)."""
DECREASE = 0.05
"""The merit must decrease by at least this share of the predicted decrease (the authors' value)."""
BACKTRACKS = 10
UNCORRECTED = 0.2
"""Share of δ by which a step may increase the errors of the levels above without a second-order
correction."""
CORRECTIONS = 4
"""The line search corrects only its first steps, up to this number, see `_led_back`. Shorter steps are not
corrected."""

_STILL = 1e-9
_FEASIBLE = 1e-7
_ROUNDING = 1e-12


class Solved(NamedTuple):
    """The result of one level.

    Attributes:
        at: the inputs of the solution, with their kinematics.
        status, fallback, kkt_residual, steps, unsolved, time_us: see `LevelEvidence`.
        rows, multipliers: rows and multipliers of the last QP.
    """

    at: Iterate
    status: str
    fallback: str
    kkt_residual: float
    steps: tuple[float, ...]
    unsolved: int
    time_us: float
    rows: ConstraintRows
    multipliers: Array


class _Direction(NamedTuple):
    d: Array
    """(N, n)"""
    slope: float
    """Derivative of the merit along d."""
    solution: QPSolution
    rows: ConstraintRows
    fallback: str
    H: Array
    g: Array
    own: bool
    """Whether the compiled active-set method has factored H."""


def solve_level(problem: Problem, at: Iterate) -> Solved:
    """Solves a level with at most MAX_ITER steps from an iterate. The iteration ends early when the inputs no
    longer change."""
    started = perf_counter_ns()
    steps: list[float] = []
    residual, fallback, unsolved = 0.0, "solve", 0
    direction = None
    for _ in range(problem.tick.settings.max_iter):
        direction = _direction(problem, at)
        unsolved += direction.fallback != "solve"
        if direction.fallback != "solve":
            fallback = direction.fallback
        if direction.fallback == "keep":
            steps.append(0.0)
            at = at if problem.guards else problem.tick.iterate(problem.tick.brake)
            break
        residual = max(residual, direction.solution.kkt_residual)
        before = at.U
        alpha, at = _line_search(problem, at, direction)
        steps.append(alpha)
        if float(np.abs(at.U - before).max()) < _STILL:
            break
    assert direction is not None
    return Solved(
        at,
        direction.solution.status,
        fallback,
        residual,
        tuple(steps),
        unsolved,
        (perf_counter_ns() - started) / 1e3,
        direction.rows,
        direction.solution.multipliers,
    )


def _direction(problem: Problem, at: Iterate) -> _Direction:
    """Computes the step by a QP. If the QP's rows contradict each other, they are widened such that full
    braking satisfies them."""
    tick = problem.tick
    H, g = problem.model(at)
    rows, bought = problem.with_slack(at, problem.rows(at))
    own = tick.settings.solver == "daqp" and tick.method.begin(H)
    solution = _solve(problem, H, g, rows, bought, own)
    fallback = "solve"
    if not solution.solved:
        # Below the first level, d = 0 satisfies the rows without slacks; on the first level, full braking
        # does.
        safe = (tick.brake - at.U).ravel() if not problem.guards else np.zeros(at.U.size)
        fallback = "widened"
        solution = _solve(problem, H, g, rows.widened(safe, bought), bought, own)
    if not solution.solved:
        return _Direction(np.zeros_like(at.U), 0.0, solution, rows, "keep", H, g, own)
    size = at.U.size
    slope = float(g @ solution.x[:size])
    if bought:
        slope += PENALTY * (float(solution.x[size:].sum()) - float(at.depths.sum()))
    return _Direction(solution.x[:size].reshape(at.U.shape), slope, solution, rows, fallback, H, g, own)


def _solve(problem: Problem, H: Array, g: Array, rows: ConstraintRows, bought: int, own: bool) -> QPSolution:
    """Solves min ½dᵀHd + gᵀd under the rows. A penalty is added for the slacks, one per knot, which may relax
    the last rows.

    Args:
        problem, H, g, rows: problem, Hessian, gradient and rows of the level.
        bought: number of rows, at the end, that slacks may relax.
        own: whether the compiled active-set method has factored H. If not, or if that method finds no
            verified point, the QP solver is used.
    """
    solver = problem.tick.settings.solver
    if not bought:
        if own:
            solution = problem.tick.method.solve(g, rows, problem.unchanging)
            if solution.solved or solution.status == CONTRADICTION:
                return solution
        return solve_qp(H, g, rows.A, rows.lower, rows.upper, solver)
    if own:
        # If the rows are feasible and their multipliers are below the penalty, the slacks are zero.
        solution = problem.tick.method.solve(g, rows, 0)
        if solution.solved and _price(solution, rows, bought) <= PENALTY:
            return solution
    k, N = len(g), problem.tick.settings.horizon
    A = np.zeros((len(rows.A) + N, k + N))
    A[:-N, :k] = rows.A
    A[np.arange(-N - bought, -N), k + rows.knot[-bought:] - 1] = 1.0
    A[-N:, k:] = np.eye(N)
    extended = np.zeros((k + N, k + N))
    extended[:k, :k] = H
    extended[k:, k:] = PENALTY * np.eye(N)
    lower = np.concatenate([rows.lower, np.zeros(N)])
    upper = np.concatenate([rows.upper, np.full(N, np.inf)])
    price = np.concatenate([g, np.full(N, PENALTY)])
    return solve_qp(extended, price, A, lower, upper, solver)


def _price(solution: QPSolution, rows: ConstraintRows, bought: int) -> float:
    """Returns the largest cost reduction per metre of slack over the knots."""
    paid = np.bincount(rows.knot[-bought:], np.abs(solution.multipliers[-bought:]))
    return float(paid.max())


def _line_search(problem: Problem, at: Iterate, direction: _Direction) -> tuple[float, Iterate]:
    """Returns the largest step of 1, β, β², … that satisfies (13) and sufficiently lowers the merit, and its
    iterate. The step is 0 if none of them does."""
    tick = problem.tick
    merit = problem.merit(at)
    # If the bounds of the first level are violated, the full step, which leads back to them, is always
    # accepted.
    returning = problem.forced and tick.table.outside(len(tick.rows.A)) > _FEASIBLE
    alpha = 1.0
    for attempt in range(BACKTRACKS + 1):
        trial = tick.iterate(at.U + alpha * direction.d)
        if returning:
            return alpha, trial
        enough = merit + DECREASE * alpha * min(direction.slope, 0.0) + _ROUNDING * (1.0 + abs(merit))
        bends = problem.corrects and attempt < CORRECTIONS
        fine = bends and problem.allowed(trial, UNCORRECTED)
        if bends and not fine:
            trial = _led_back(problem, at, direction, trial)
        if (fine or problem.allowed(trial)) and problem.merit(trial) <= enough:
            return alpha, trial
        alpha *= SHRINK
    return 0.0, at


def _led_back(problem: Problem, at: Iterate, direction: _Direction, trial: Iterate) -> Iterate:
    """Returns the iterate after a correction of a step. The correction is the smallest one, in the Hessian's
    norm, that removes the errors which the step has added to the levels above.

    The levels' errors are nonlinear. A step along their linear rows violates (13) by an amount that grows
    with the square of the step's length. Without this second-order correction only short steps are accepted.
    """
    solution = _solve(
        problem, direction.H, np.zeros_like(direction.g), problem.rows(trial, at), 0, direction.own
    )
    return problem.tick.iterate(trial.U + solution.x.reshape(trial.U.shape)) if solution.solved else trial
