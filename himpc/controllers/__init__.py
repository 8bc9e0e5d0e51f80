"""Controllers: one file, one class each."""

from collections.abc import Callable

from himpc.controllers.controller import Controller
from himpc.controllers.himpc import HIMPC
from himpc.controllers.settings import Settings
from robots import Robot
from robots.errors import unknown_name

CONTROLLERS: dict[str, str] = {
    "himpc": "hierarchical incremental MPC: torque level, strict priorities, no dynamic model",
}
"""One line per controller."""

_MAKERS: dict[str, Callable[[Robot, Settings], Controller]] = {
    "himpc": HIMPC,
}


def make_controller(name: str, robot: Robot, settings: Settings) -> Controller:
    """A controller by its name. Raises InputError: unknown name, or settings that do not fit the robot."""
    if name not in _MAKERS:
        raise unknown_name("controller", name, CONTROLLERS)
    return _MAKERS[name](robot, settings)


__all__ = ["CONTROLLERS", "HIMPC", "Controller", "Settings", "make_controller"]
