"""If rows of distances contradict the limits of the joints, they are relaxed first, by least squares; the
rows of torque, velocity and position are not relaxed."""

from __future__ import annotations

import numpy as np
import pytest

from himpc.limits import TORQUE, VELOCITY, Rows
from himpc.limits.constraint import Directions
from himpc.limits.distance import DISTANCE
from himpc.limits.rest import braking, least_slack, missed
from himpc.limits.rows import profiles

N, n = 5, 3
CONSTRAINTS = (TORQUE, VELOCITY, DISTANCE)


def rows_with(least: float, torque: float = 10.0) -> Rows:
    """Returns two rows of distances, in opposite directions of the first two joints; each requires `least`
    N·m at every knot."""
    D = np.zeros((n, n))
    D[0], D[1] = (0.6, 0.8, 0.0), (-0.6, -0.8, 0.0)
    lower, upper = np.full((3 * N, n), -np.inf), np.full((3 * N, n), np.inf)
    lower[:N], upper[:N] = -torque, torque
    lower[N : 2 * N], upper[N : 2 * N] = -4.0 * torque, 4.0 * torque
    lower[2 * N :, :2] = least
    directions = (None, None, Directions(D, ("one", "other", "")))
    return Rows(profiles(N, CONSTRAINTS), lower, upper, CONSTRAINTS, directions=directions)


@pytest.mark.parametrize("torque", [10.0, 0.1])
def test_rows_that_contradict_each_other_give_way_alike(torque: float) -> None:
    """Neither row can be satisfied: both are violated by the same amount, and the rows of torque and velocity
    hold."""
    rows = rows_with(2.0, torque)
    left = missed(rows, braking(rows))
    assert left[: 2 * N].max() == 0.0
    assert left[2 * N :, 0] == pytest.approx(2.0, abs=1e-3)
    assert left[2 * N :, 1] == pytest.approx(2.0, abs=1e-3)
    assert not least_slack(rows)[: 2 * N].any()


def test_a_row_beyond_what_the_joints_can_do_is_met_as_far_as_they_can() -> None:
    """A single distance requires more than the velocity limit permits, so the joints move at their limits."""
    rows = rows_with(100.0)
    rows.lower[2 * N :, 1] = -np.inf
    U = braking(rows)
    assert missed(rows, U)[: 2 * N].max() == 0.0
    assert rows.values(U)[2 * N - 1, :2] == pytest.approx(40.0)


def test_rows_that_can_be_met_are_met() -> None:
    rows = rows_with(-1.0)
    rows.lower[2 * N :, 0] = 0.5
    rows.lower[2 * N :, 1] = -30.0
    assert missed(rows, braking(rows)).max() < 1e-3
