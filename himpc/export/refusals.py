"""Refuses controllers that cannot be exported, with one sentence for each reason."""

from __future__ import annotations

from himpc.controllers.controller import Controller
from himpc.controllers.himpc import HIMPC
from himpc.controllers.hiqp import HIQP
from himpc.controllers.nhimpc import NHIMPC
from himpc.controllers.weighted import Weighted
from himpc.formulation.settings import Settings
from himpc.limits.constraints import imposed
from himpc.limits.distance import DISTANCE
from himpc.tick.configure import is_built_in
from himpc.tick.tables import python_constraints
from robots import InputError


def check(controller: Controller, settings: Settings) -> None:
    """Raises InputError if this controller uses something that cannot be exported."""
    if type(controller) not in (HIMPC, HIQP, NHIMPC, Weighted):
        raise InputError(
            f"the controller {type(controller).__name__} is not compiled: export supports himpc, hiqp, "
            "nhimpc and weighted"
        )
    if settings.M_bar_adapt:
        raise InputError(
            "M_bar_adapt needs the robot's dynamic model, which is not exported: set it to false"
        )
    constraints = [each for each in python_constraints(imposed(settings.limits)) if each is not DISTANCE]
    if constraints:
        raise InputError(
            f"the limit '{constraints[0].label}' is computed in Python, which is not exported: switch it off"
        )
    for level in settings.stack:
        for task in level.tasks:
            if not is_built_in(task):
                raise InputError(
                    f"task '{task.name}' is a {type(task).__name__}, which Python computes: export supports "
                    "positions and orientations of frames, joints and postures"
                )
