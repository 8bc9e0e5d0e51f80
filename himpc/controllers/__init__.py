"""Controllers: one file, one class each."""

from collections.abc import Callable
from functools import partial

from himpc.controllers.controller import Controller
from himpc.controllers.himpc import HIMPC
from himpc.controllers.hiqp import HIQP
from himpc.controllers.hqp import HQP
from himpc.controllers.nhimpc import NHIMPC
from himpc.controllers.null_space_control import DAMPED
from himpc.controllers.osf import OSF
from himpc.controllers.settings import Settings
from himpc.controllers.tdeosf import TDEOSF
from himpc.controllers.weighted import Weighted
from robots import Robot
from robots.errors import unknown_name

CONTROLLERS: dict[str, str] = {
    "himpc": "hierarchical incremental MPC: torque level, strict priorities, no dynamic model",
    "hiqp": "HIMPC with a horizon of one knot: the best next step, and nothing beyond it",
    "nhimpc": "HIMPC with the Jacobians along its own prediction: sequential QPs until they agree",
    "weighted": "HIMPC without priorities: all tasks in one cost, a level counts as much as its Q",
    "osf": "operational-space control with null-space projection on the nominal model; no bounds, no damping",
    "tdeosf": "OSF with time-delay estimation in place of the model; no bounds, no damping",
    "osf_damped": "OSF with damped least squares near singularities; what the paper's OSF leaves out",
    "tdeosf_damped": "TDEOSF with damped least squares near singularities",
    "hqp": "one-step hierarchical QP on the nominal model, within the torque bounds",
}
"""One line per controller."""

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
}


def make_controller(name: str, robot: Robot, settings: Settings) -> Controller:
    """A controller by its name. Raises InputError: unknown name, or settings that do not fit the robot."""
    if name not in _MAKERS:
        raise unknown_name("controller", name, CONTROLLERS)
    return _MAKERS[name](robot, settings)


__all__ = [
    "CONTROLLERS",
    "HIMPC",
    "HIQP",
    "HQP",
    "NHIMPC",
    "OSF",
    "TDEOSF",
    "Controller",
    "Settings",
    "Weighted",
    "make_controller",
]
