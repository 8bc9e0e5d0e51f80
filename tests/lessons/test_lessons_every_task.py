"""Every kind of task on every robot of the catalog is held, and dragged to where it can be had."""

from __future__ import annotations

import pytest

from benchmarks.every_task import CONTROLLERS, measured
from himpc.tasks import KINDS
from robots import CATALOG


@pytest.mark.parametrize("robot", CATALOG)
def test_every_kind_of_task_settles(robot: str) -> None:
    """Within 1 mm or 0.1°. Each kind meets each controller on every other robot;
    `python -m benchmarks.every_task` has the whole product."""
    first = list(CATALOG).index(robot)
    for place, kind in enumerate(KINDS):
        found = measured(robot, kind, CONTROLLERS[(first + place) % 2], seconds=3.0)
        assert found.held < 1.0, found
        assert found.settled < 1.0, found
