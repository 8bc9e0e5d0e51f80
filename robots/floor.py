"""The floor on which a robot stands, if its geometry allows one."""

from __future__ import annotations

from robots.collision import Floor
from robots.robot import Robot
from robots.world import Thing, World

_SUNK = 0.03  # largest distance of a standing base from the floor, m


def standing_floor(robot: Robot) -> World:
    """Returns the floor at the height 0 on which a robot stands. Returns nothing for a robot that hangs, or
    whose base or home posture is below this height, for example for an arm that moves in a horizontal
    plane."""
    return () if no_floor(robot) else (Thing(Floor()),)


def no_floor(robot: Robot) -> str:
    """Returns the text for the report if a robot does not stand on a floor; "" if it stands on one."""
    from robots.mechanics.exclusions import lowest  # needs MuJoCo

    base, rest = lowest(robot)
    if base is None:
        return "its scene has no floor: the base has no shape that could stand on one"
    if not stands(base):
        return f"its scene has no floor: the lowest point of the base is at {base:.2f} m, and not at 0"
    if rest is not None and rest <= 0.0:
        return f"its scene has no floor: at home the arm reaches down to {rest:.2f} m"
    return ""


def stands(base: float) -> bool:
    """Returns whether a base whose lowest point has this height, m, stands on a floor at the height 0."""
    return -_SUNK < base < _SUNK
