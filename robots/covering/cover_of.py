"""`cover_of`: the cover that a robot has, or that is made for it."""

from __future__ import annotations

from robots.geometry.cover import Cover
from robots.robot import Robot


def cover_of(robot: Robot) -> Cover:
    """Returns the cover of a robot: the stored one of a robot of the catalog, else the one that was made when
    it was imported."""
    if robot.cover is not None:
        return robot.cover
    from robots.covering.covers import made_cover  # it loads MuJoCo, which a stored cover does not need

    return made_cover(robot)
