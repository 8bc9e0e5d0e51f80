"""Random drags into the floor, into the robot and out of reach, with distances kept; they are a small part of
`benchmarks.avoidance`."""

from __future__ import annotations

import pytest

from benchmarks.avoidance import DEEP_M, ROBOTS, run

SEED = 2


@pytest.mark.parametrize("robot", ROBOTS)
def test_no_drag_makes_a_robot_touch_or_loses_it(robot: str) -> None:
    """MuJoCo's geometry finds no penetration deeper than 1 mm between bodies whose distance is kept, and
    joints stay within 110 % of their velocity limits."""
    total, _ = run(robot, 1, SEED, ["avoidance.on=true"], "himpc")
    assert total.drags == 4
    assert total.deepest <= DEEP_M, total.where
    assert total.lost == 0
    assert total.speed < 1.1


def test_without_rows_the_same_drags_go_deeper_and_faster() -> None:
    """The drags of the iiwa in the test before end in the floor if no distance is kept."""
    total, _ = run("iiwa14", 1, SEED, ["avoidance.on=false"], "himpc")
    assert total.deepest > DEEP_M
    assert total.speed > 2.0
