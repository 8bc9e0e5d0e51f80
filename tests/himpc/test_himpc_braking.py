"""Increments that are computed joint by joint satisfy all bounds if these are feasible (linear programs are
the reference), and they brake the joints."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from himpc.limits import POSITION, TORQUE, VELOCITY, Limits, Rows, build_rows, in_force
from himpc.limits.rest import braking, least_slack
from himpc.limits.rows import profiles
from himpc.prediction import JointState
from robots import load_robot

Array = NDArray[np.float64]

seeds = st.integers(0, 2**32 - 1)


def slack_needed(rows: Rows, joint: int) -> float:
    """Returns the amount by which the most violated row of a joint must be relaxed, computed by linear
    programming in (U, slack); it is 0 if no row must be relaxed."""
    from scipy.optimize import linprog

    N = rows.L.shape[1]
    lower, upper = rows.lower[:, joint], rows.upper[:, joint]
    above, below = np.isfinite(upper), np.isfinite(lower)
    A = np.vstack([rows.L[above], -rows.L[below]])
    b = np.concatenate([upper[above], -lower[below]])
    A = np.hstack([A, -np.ones((len(A), 1))])
    found = linprog(np.eye(N + 1)[N], A_ub=A, b_ub=b, bounds=[*[(None, None)] * N, (0, None)], method="highs")
    assert found.success
    return float(found.x[N])


def random_rows(seed: int, n: int, N: int, position_rows: bool) -> tuple[Rows, float]:
    """Returns rows around a random point: some are wide, some are very narrow, and some exclude the point."""
    rng = np.random.default_rng(seed)
    constraints = (TORQUE, VELOCITY, POSITION) if position_rows else (TORQUE, VELOCITY)
    L = profiles(N, constraints)
    value = L @ rng.normal(0, 10.0 ** rng.uniform(-1, 1.5), (N, n))
    room = float(rng.choice([1e-5, 1e-2, 1.0, 30.0]))
    lower = value - room * 10 ** rng.uniform(0, 2, value.shape)
    upper = value + room * 10 ** rng.uniform(0, 2, value.shape)
    if rng.random() < 0.4:
        moved = rng.normal(0, 5 * room, value.shape) * (np.arange(len(L)) >= N)[:, None]
        lower, upper = lower + moved, upper + moved
    free = (rng.random(value.shape) < 0.1) & (np.arange(len(L)) >= N)[:, None]
    lower, upper = np.where(free, -np.inf, lower), np.where(free, np.inf, upper)
    rest = rng.normal(0, 10.0, (N, n))
    return Rows(L, lower, upper, constraints, rest=rest), room


@given(seeds, st.integers(1, 3), st.integers(1, 12), st.booleans())
@settings(max_examples=150)
def test_braking_meets_all_rows_whenever_any_increments_do(
    seed: int, n: int, N: int, position_rows: bool
) -> None:
    """Whenever a linear program finds the rows feasible, all of them are satisfied. The rows are wide, very
    narrow or infeasible; torque rows are always satisfied."""
    rows, room = random_rows(seed, n, N, position_rows)
    U = braking(rows)
    value = rows.L @ U
    excess = np.maximum(np.maximum(value - rows.upper, rows.lower - value), 0.0)
    assert excess[:N].max() <= 1e-9
    slack = least_slack(rows)
    for joint in range(n):
        needed = slack_needed(rows, joint)
        if needed <= 1e-9 * room:
            assert excess[:, joint].max() <= 2e-7
            assert not (slack[:, joint] > 2e-7).any()
        elif needed > 1e-6:
            assert slack[:, joint].any()


@pytest.mark.parametrize("position", ["viability", "paper", "off"])
@pytest.mark.parametrize("N", [1, 5, 30])
def test_braking_brakes(N: int, position: str) -> None:
    """For fast joints and random torques, the velocities at the last knot are close to those that `BRAKING`
    prescribes, and no joint becomes faster."""
    robot = load_robot("iiwa14")
    rng = np.random.default_rng(N)
    limits = Limits(position=position)  # pyright: ignore[reportArgumentType]
    force, M_bar, T_s = in_force(robot, limits), np.full(robot.n, 0.05), 1e-3
    for _ in range(20):
        q = 0.5 * rng.uniform(robot.q_lower, robot.q_upper)
        state = JointState(q, 0.8 * robot.v_limit * rng.uniform(-1, 1, robot.n), rng.normal(0, 5, robot.n))
        tau_0 = 0.5 * robot.tau_limit * rng.uniform(-1, 1, robot.n)
        rows = build_rows(state, tau_0, M_bar, limits, force, N, T_s)
        assert rows.rest is not None
        w = (rows.L @ braking(rows))[N : 2 * N] * (T_s / M_bar)
        after = state.v + state.gained_velocity(N, T_s) + w
        wanted = state.v * np.exp(-20.0 * T_s * np.arange(1, N + 1))[:, None]
        assert np.abs(after[-1] - wanted[-1]).max() <= 0.05 * np.abs(robot.v_limit).max()
        assert (np.abs(after[-1]) <= np.abs(state.v) + 1e-9).all()
