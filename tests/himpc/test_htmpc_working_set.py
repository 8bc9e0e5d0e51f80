"""QPs on growing sets of rows have the solution of the whole problem."""

from __future__ import annotations

import numpy as np
import pytest
from htmpc_problems import at_home, mobile_settings, previews

from himpc.htmpc import HTMPC
from himpc.htmpc.working_set import solve_by_working_set
from himpc.qp import kkt_residual, solve_qp
from robots import load_robot

Array = np.ndarray
NONE = np.zeros(80, bool)


def problem(seed: int, scale: float) -> tuple[Array, Array, Array, Array, Array]:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(20, 20))
    A = rng.normal(size=(80, 20))
    room = scale * rng.uniform(0.05, 1.0, (2, 80))
    return root @ root.T + 0.1 * np.eye(20), 10 * rng.normal(size=20), A, -room[0], room[1]


@pytest.mark.parametrize("scale", [0.2, 1.0, 20.0])
def test_same_point_and_multipliers_as_with_all_rows(scale: float) -> None:
    bound = 0
    for seed in range(15):
        H, f, A, lower, upper = problem(seed, scale)
        few, all_rows = (
            solve_by_working_set(H, f, A, lower, upper, NONE, "daqp"),
            solve_qp(H, f, A, lower, upper),
        )
        assert few.solved
        np.testing.assert_allclose(few.x, all_rows.x, atol=1e-7)
        assert kkt_residual(H, f, A, lower, upper, few.x, few.multipliers) < 1e-7
        bound += int((np.abs(few.multipliers) > 1e-6).sum())
    assert bound > 0


def test_rows_that_contradict_each_other_stay_unsolved() -> None:
    H, f, A, lower, upper = problem(0, 1.0)
    A[1] = A[0]
    lower[0], upper[1] = 0.6, 0.4
    upper[0], lower[1] = 1.0, -1.0
    assert not solve_by_working_set(H, f, A, lower, upper, NONE, "daqp").solved


def test_both_solvers_give_the_same_plan() -> None:
    robot = load_robot("ridgeback-ur10")
    plans = []
    for solver in ("daqp", "proxqp"):
        settings = mobile_settings(solver=solver)
        references = at_home(robot, np.array([-0.6, -0.7]))
        plans.append(
            HTMPC(robot, settings).step(robot.home, np.zeros(9), previews(references, 0.0, settings))
        )
    assert plans[0].unsolved == plans[1].unsolved == 0
    np.testing.assert_allclose(plans[0].u, plans[1].u, atol=1e-4)
