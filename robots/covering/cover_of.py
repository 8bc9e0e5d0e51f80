"""`cover_of`: the stored cover of a robot, or a new one."""

from __future__ import annotations

from robots.geometry import Cover
from robots.robot import Robot


def cover_of(robot: Robot) -> Cover:
    """Returns the cover of a robot: the stored cover for a robot of the catalog, otherwise the cover that was
    made when the robot was imported."""
    if robot.cover is not None:
        return robot.cover
    from robots.covering.covers import made_cover  # it loads MuJoCo, which a stored cover does not need

    return made_cover(robot)
