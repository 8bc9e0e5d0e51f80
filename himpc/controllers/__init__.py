"""The controllers; each file contains one class."""

from typing import TYPE_CHECKING

from himpc.catalog import CONTROLLERS
from robots.lazy import lazily

if TYPE_CHECKING:
    from himpc.controllers.controller import Controller
    from himpc.controllers.himpc import HIMPC
    from himpc.controllers.hiqp import HIQP
    from himpc.controllers.hqp import HQP
    from himpc.controllers.make import make_controller
    from himpc.controllers.nhimpc import NHIMPC
    from himpc.controllers.osf import OSF
    from himpc.controllers.tdeosf import TDEOSF
    from himpc.controllers.weighted import Weighted
    from himpc.formulation.settings import Settings
    from himpc.tick.target import dragged_target

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
    "dragged_target",
    "make_controller",
]

__getattr__ = lazily("himpc.controllers")
