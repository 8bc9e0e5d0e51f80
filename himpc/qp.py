"""The interface to the QP solvers. No other module imports them."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from io import StringIO
from time import perf_counter_ns
from typing import Literal, NamedTuple

import daqp
import numpy as np
import proxsuite

from robots.arrays import Array

Solver = Literal["daqp", "proxqp", "qpoases"]
"""The names of the solvers. The paper uses `qpoases`, which is part of CasADi, see `is_installed`."""

KKT_TOLERANCE = 1e-6
"""A point whose scaled KKT residual is larger counts as unsolved, whatever the solver's status is."""

_PRIMAL_TOLERANCE = 1e-9
_NOISE = 1e-10
_DAQP_INFINITY = 1e30
_DAQP_EQUALITY = 5


@dataclass(frozen=True, slots=True, eq=False)
class QPSolution:
    """A point, its multipliers (> 0 at an upper bound, < 0 at a lower one), its verified residual and the
    solver's own wall time, set-up included."""

    x: Array
    multipliers: Array
    kkt_residual: float
    status: str
    time_us: float

    @property
    def solved(self) -> bool:
        return self.kkt_residual <= KKT_TOLERANCE


def is_installed(solver: Solver) -> bool:
    """Returns whether a solver is installed."""
    return solver != "qpoases" or find_spec("casadi") is not None


def solve_qp(
    H: Array,
    f: Array,
    A: Array,
    lower: Array,
    upper: Array,
    solver: Solver = "daqp",
    iterations: int | None = None,
) -> QPSolution:
    """Solves min ½xᵀHx + fᵀx subject to lower ≤ Ax ≤ upper; a row with lower = upper is an equality.

    Args:
        H: (k, k), positive definite.
        f: (k,).
        A: (r, k).
        lower, upper: (r,), ±inf where there is no bound.
        solver: name of the solver.
        iterations: largest number of iterations of all attempts of DAQP together; None: no limit.

    Returns:
        The solver's point and its KKT residual. The residual is computed here; the solver's status is not
        used.
    """
    qp, left = _QP(H, f, A, lower, upper), _Iterations(iterations)
    attempts = _ATTEMPTS[solver]
    solution = _attempt(attempts[0], qp, left)
    for attempt in attempts[1:]:
        if solution.solved or left.none:
            break
        again = _attempt(attempt, qp, left)
        solution = replace(again, time_us=solution.time_us + again.time_us)
    return solution


class _QP(NamedTuple):
    """The arguments of `solve_qp`."""

    H: Array
    f: Array
    A: Array
    lower: Array
    upper: Array


class _Iterations:
    """The number of iterations that are left."""

    def __init__(self, left: int | None) -> None:
        self._left = left

    @property
    def none(self) -> bool:
        return self._left is not None and self._left <= 0

    @property
    def options(self) -> dict[str, float]:
        return {} if self._left is None else {"iter_limit": self._left}

    def spend(self, used: int) -> None:
        if self._left is not None:
            self._left -= used


def _attempt(attempt: Callable[..., tuple[Array, Array, str]], qp: _QP, left: _Iterations) -> QPSolution:
    started = perf_counter_ns()
    x, multipliers, status = attempt(qp, left)
    time_us = (perf_counter_ns() - started) / 1e3
    with np.errstate(all="ignore"):  # after an interruption the point may be arbitrary
        residual = kkt_residual(*qp, x, multipliers)
    return QPSolution(x, multipliers, residual, status, time_us)


def _daqp(qp: _QP, left: _Iterations, scaled: bool = True, **options: float) -> tuple[Array, Array, str]:
    H, f, A, lower, upper = qp
    if scaled:
        # DAQP treats rows that are small relative to √H as zero and ignores them without a message. H is
        # therefore scaled to size one and rows to length one. Rows that are rounding errors must not be
        # scaled up to constraints.
        size = float(H.trace()) / len(H)
        length = np.sqrt(np.einsum("ij,ij->i", A, A))
        stretch = np.where(length > _NOISE, 1.0 / np.maximum(length, _NOISE), 1.0)
    else:
        size, stretch = 1.0, np.ones(len(A))
    sense = np.where(lower == upper, _DAQP_EQUALITY, 0).astype(np.int32)
    x, _, flag, info = daqp.solve(
        H / size,
        f / size,
        A * stretch[:, None],
        np.minimum(upper * stretch, _DAQP_INFINITY),
        np.maximum(lower * stretch, -_DAQP_INFINITY),
        sense,
        primal_tol=_PRIMAL_TOLERANCE,
        **options,
        **left.options,
    )
    left.spend(int(info["iterations"]))
    return x, info["lam"] * stretch * size, "optimal" if flag == 1 else f"daqp {flag}"


_DAQP = (
    _daqp,
    partial(_daqp, eps_prox=1e-6, eta_prox=1e-12),
    partial(_daqp, eps_prox=1e-2, eta_prox=1e-12),
    partial(_daqp, scaled=False),
)
"""DAQP fails on 1 % of hard but feasible QPs: it does not terminate, or reports that they are infeasible.
Proximal steps or another scaling then find the optimum."""


def _proxqp(problem: _QP, _: _Iterations) -> tuple[Array, Array, str]:
    H, f, A, lower, upper = problem
    equal = lower == upper
    free = ~equal
    qp = proxsuite.proxqp.dense.QP(f.size, int(equal.sum()), int(free.sum()))
    qp.settings.eps_abs = _PRIMAL_TOLERANCE
    qp.settings.max_iter = 1000
    qp.init(H, f, A[equal], lower[equal], A[free], lower[free], upper[free])
    qp.solve()
    multipliers = np.empty(len(A))
    multipliers[equal], multipliers[free] = qp.results.y, qp.results.z
    status = str(qp.results.info.status).rsplit(".", 1)[-1]
    return qp.results.x, multipliers, "optimal" if status == "PROXQP_SOLVED" else status.lower()


def _qpoases(problem: _QP, _: _Iterations) -> tuple[Array, Array, str]:
    H, f, A, lower, upper = problem
    casadi = import_module("casadi")
    shapes = {"h": casadi.Sparsity.dense(*H.shape), "a": casadi.Sparsity.dense(*A.shape)}
    options = {"printLevel": "none", "error_on_fail": False, "print_time": False}
    # Every QP gets a new solver object. With a warm start, the point would depend on the QPs solved before.
    with redirect_stdout(StringIO()):  # qpOASES prints its licence
        qp = casadi.conic("qp", "qpoases", shapes, options)
        solution = qp(h=H, g=f, a=A, lba=lower, uba=upper)
    status = str(qp.stats()["return_status"])
    x, multipliers = (np.array(solution[key], float).ravel() for key in ("x", "lam_a"))
    return x, multipliers, "optimal" if status == "Successful return." else status.lower()


_ATTEMPTS = {"daqp": _DAQP, "proxqp": (_proxqp,), "qpoases": (_qpoases,)}


def kkt_residual(
    H: Array, f: Array, A: Array, lower: Array, upper: Array, x: Array, multipliers: Array
) -> float:
    """Returns the largest violation of the KKT conditions, of which some are scaled.

    Violations of stationarity, of the multipliers' signs and of complementarity are divided by
    max(1, ‖H‖‖x‖, ‖f‖). A violation of feasibility is not scaled. A point that is not finite has an infinite
    residual.
    """
    gradient = H @ x + f + A.T @ multipliers
    scale = max(1.0, _norm(H) * _norm(x), _norm(f))
    value = A @ x
    residual = max(
        float(np.abs(gradient).max()) / scale, row_residual(value, lower, upper, multipliers, scale)
    )
    return residual if residual >= 0 else float("inf")


def _norm(x: Array) -> float:
    return math.sqrt(float(np.vdot(x, x)))


def row_residual(value: Array, lower: Array, upper: Array, multipliers: Array, scale: float) -> float:
    """Returns the violation of feasibility and of complementarity (with the right signs) for rows lower ≤
    value ≤ upper."""
    if not value.size:
        return 0.0
    gap = np.minimum(upper - value, value - lower)
    # The sign of a multiplier selects one of the two bounds. The product of the multiplier and the gap to
    # this bound must be zero. The cap makes the product of an infinite gap and a zero multiplier zero.
    own = np.where(multipliers > 0, upper - value, value - lower)
    product = np.abs(multipliers) * np.minimum(np.abs(own), 1e6)
    return max(-float(gap.min()), float(product.max()) / scale, 0.0)
