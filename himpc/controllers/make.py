"""Creates a controller by its name."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from himpc.catalog import CONTROLLERS
from himpc.controllers.controller import Controller
from himpc.controllers.himpc import HIMPC
from himpc.controllers.himpc_filtered import FilteredHIMPC
from himpc.controllers.himpc_printed import PrintedHIMPC
from himpc.controllers.hiqp import HIQP
from himpc.controllers.hqp import HQP
from himpc.controllers.nhimpc import NHIMPC
from himpc.controllers.null_space_control import DAMPED
from himpc.controllers.osf import OSF
from himpc.controllers.tdeosf import TDEOSF
from himpc.controllers.weighted import Weighted
from himpc.formulation.settings import Settings
from robots import Robot
from robots.errors import unknown_name

_MAKERS: dict[str, Callable[[Robot, Settings], Controller]] = {
    "himpc": HIMPC,
    "hiqp": HIQP,
    "nhimpc": NHIMPC,
    "weighted": Weighted,
    "osf": OSF,
    "tdeosf": TDEOSF,
    "osf_damped": partial(OSF, damping=DAMPED),
    "tdeosf_damped": partial(TDEOSF, damping=DAMPED),
    "hqp": HQP,
    "himpc_filtered": FilteredHIMPC,
    "himpc_printed": PrintedHIMPC,
}


def make_controller(name: str, robot: Robot, settings: Settings) -> Controller:
    """Creates a controller by its name. Raises InputError if the name is unknown, or if the settings do not
    fit the robot."""
    if name not in _MAKERS:
        raise unknown_name("controller", name, CONTROLLERS)
    return _MAKERS[name](robot, settings)
