"""Every kind of task on every robot of the catalog is held, and dragged to where it can be had."""

from __future__ import annotations

import pytest

from benchmarks.every_task import CONTROLLERS, measured
from himpc.tasks import KINDS

ROBOTS = {"planar3": 2.0, "iiwa14": 1.3, "panda": 1.5, "baxter": 1.5, "ridgeback-ur10": 1.1}
"""s after which a target that was dragged is reached. HQP does not know the motors of the planar arm."""


@pytest.mark.parametrize("first", range(len(ROBOTS)), ids=list(ROBOTS))
def test_every_kind_of_task_settles(first: int) -> None:
    """Within 1 mm or 0.1°; each kind meets each controller. `python -m benchmarks.every_task` has the whole
    product."""
    robot, seconds = list(ROBOTS.items())[first]
    for place, kind in enumerate(KINDS):
        found = measured(robot, kind, CONTROLLERS[(first + place) % 2], seconds=seconds)
        assert found.held < 1.0, found
        assert found.settled < 1.0, found
