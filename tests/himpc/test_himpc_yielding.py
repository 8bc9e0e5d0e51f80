"""If a level has no optimum, the increments that are applied satisfy all rows that couple joints, if this is
possible. If not, they satisfy the hard rows, and the others are relaxed by least squares."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from himpc.limits import TORQUE, TORQUE_RATE, VELOCITY, Rows
from himpc.limits.constraint import Constraint, Directions
from himpc.limits.rest import braking, groups, least_slack
from himpc.limits.rows import profiles
from himpc.limits.velocity import summed_twice

Array = NDArray[np.float64]


def coupling(hard: bool) -> Constraint:
    return Constraint("coupling", summed_twice, 1, hard, is_on=lambda _: False, bounds=VELOCITY.bounds)


def random_rows(seed: int, n: int, N: int, hard: bool, missed: float) -> Rows:
    """Returns rows around a point; some soft rows are moved away from it by up to `missed` N·m."""
    rng = np.random.default_rng(seed)
    constraints = (TORQUE, VELOCITY, TORQUE_RATE, coupling(hard))
    D = np.zeros((n, n))
    D[:2] = rng.normal(0, 1, (2, n)) * (rng.random((2, n)) < 0.7)
    D[:2] /= np.maximum(np.linalg.norm(D[:2], axis=1, keepdims=True), 1e-9)
    names = tuple(map(str, range(n)))
    infinite = np.full((4 * N, n), np.inf)
    rows = Rows(
        profiles(N, constraints),
        -infinite,
        infinite,
        constraints,
        rest=rng.normal(0, 10.0, (N, n)),
        directions=(None, None, None, Directions(D, names)),
    )
    value = rows.values(rng.normal(0, 1.0, (N, n)))
    lower, upper = (value + side * 10 ** rng.uniform(-2, 1, value.shape) for side in (-1.0, 1.0))
    shift = rng.normal(0, missed, value.shape) * ~rows.is_hard[:, None] if missed else 0.0
    unused = np.zeros((4 * N, n), bool)
    unused[3 * N :] = ~D.any(axis=1)
    return rows._replace(
        lower=np.where(unused, -np.inf, lower + shift), upper=np.where(unused, np.inf, upper + shift)
    )


def excess(rows: Rows, U: Array) -> Array:
    value = rows.values(U)
    return np.maximum(np.maximum(value - rows.upper, rows.lower - value), 0.0)


seeds = st.integers(0, 2**32 - 1)


@given(seeds, st.integers(2, 5), st.integers(1, 8), st.booleans())
@settings(max_examples=40, deadline=None)
def test_whatever_can_be_met_is_met(seed: int, n: int, N: int, hard: bool) -> None:
    """If some point satisfies all rows, the increments satisfy them as well, and no row is relaxed."""
    rows = random_rows(seed, n, N, hard, missed=0.0)
    assert excess(rows, braking(rows)).max() <= 2e-7
    assert not (least_slack(rows) > 2e-7).any()


@given(seeds, st.integers(2, 4), st.integers(1, 6), st.booleans())
@settings(max_examples=40, deadline=None)
def test_hard_rows_hold_and_the_others_give_way_by_least_squares(
    seed: int, n: int, N: int, hard: bool
) -> None:
    """The violation of soft rows is least: its gradient is a nonnegative combination of hard rows at their
    bounds."""
    from scipy.optimize import nnls

    rows = random_rows(seed, n, N, hard, missed=20.0)
    U = braking(rows)
    short = excess(rows, U)
    assert short[rows.is_hard].max() <= 2e-7
    A, value = rows.matrix, rows.values(U).ravel()
    over, under = value - rows.upper.ravel(), rows.lower.ravel() - value
    soft = np.repeat(~rows.is_hard, n)
    slope = A.T @ (soft * (np.maximum(over, 0.0) - np.maximum(under, 0.0)))
    near = 1e-5
    pushes = np.vstack([A[~soft & (over > -near)], -A[~soft & (under > -near)]])
    left = nnls(pushes.T, -slope)[1] if len(pushes) else np.linalg.norm(slope)
    assert left <= 1e-4 * (1.0 + np.linalg.norm(short))


def test_joints_that_share_a_direction_are_a_group() -> None:
    """Joints form a group if they share a direction that has a bound."""
    D = np.zeros((5, 5))
    D[0, [0, 3]], D[1, [3, 4]], D[2, [1, 2]] = 0.7, 0.7, 0.7
    rows = random_rows(0, 5, 2, True, 0.0)
    upper, lower = rows.upper.copy(), rows.lower.copy()
    upper[6:], lower[6:] = np.inf, -np.inf
    upper[6:, :2] = 1.0
    rows = rows._replace(
        lower=lower, upper=upper, directions=(None, None, None, Directions(D, tuple("abcde")))
    )
    assert sorted(groups(rows, 5)) == [[0, 3, 4], [1], [2]]


@pytest.mark.parametrize("seed", range(3))
def test_a_long_plan_of_many_joints_stays_within_torque_and_rate(seed: int) -> None:
    """The plan has too many unknowns for one QP, and some bounds leave almost no room; the hard rows hold
    nevertheless."""
    rows = random_rows(seed, 7, 40, hard=False, missed=20.0)
    assert excess(rows, braking(rows))[rows.is_hard].max() <= 1e-9
