"""Every kind of task is held on every robot of the catalog, and dragged to a reachable target."""

from __future__ import annotations

import pytest

from benchmarks.every_task import CONTROLLERS, measured
from himpc.tasks import KINDS

ROBOTS = {"planar3": 2.0, "iiwa14": 1.3, "panda": 1.5, "baxter": 1.5, "ridgeback-ur10": 1.1}
"""s within which a dragged target is reached. HQP's model does not contain the motors of the planar arm."""


@pytest.mark.parametrize(
    "first",
    [
        pytest.param(place, id=name, marks=() if place == 0 else pytest.mark.nightly("himpc/tasks"))
        for place, name in enumerate(ROBOTS)
    ],
)
def test_every_kind_of_task_settles(first: int) -> None:
    """Errors are within 1 mm or 0.1°, and each kind of task runs with each controller on some robot. `python
    -m benchmarks.every_task` tests all combinations."""
    robot, seconds = list(ROBOTS.items())[first]
    for place, kind in enumerate(KINDS):
        found = measured(robot, kind, CONTROLLERS[(first + place) % 2], seconds=seconds)
        assert found.held < 1.0, found
        assert found.settled < 1.0, found
