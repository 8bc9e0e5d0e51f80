"""Every kind of task on the robots with one arm is held, and dragged to where it can be had."""

from __future__ import annotations

import pytest

from benchmarks.every_task import CONTROLLERS, measured
from himpc.tasks import KINDS

ROBOTS = ("planar3", "iiwa14", "panda")


@pytest.mark.parametrize("robot", ROBOTS)
def test_every_kind_of_task_settles(robot: str) -> None:
    """Within 1 mm or 0.1°; each kind meets each controller. `python -m benchmarks.every_task` has the whole
    product, other robots included: under HQP they do not settle in all kinds."""
    first = ROBOTS.index(robot)
    for place, kind in enumerate(KINDS):
        found = measured(robot, kind, CONTROLLERS[(first + place) % 2], seconds=3.0)
        assert found.held < 1.0, found
        assert found.settled < 1.0, found
