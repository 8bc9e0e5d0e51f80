"""HIQP: HIMPC with a horizon of one knot, the local optimum with which section V of the paper compares
HIMPC."""

from __future__ import annotations

from dataclasses import replace

from himpc.controllers.himpc import HIMPC
from himpc.formulation.settings import Settings
from robots import Robot

_KNOTS = 1


class HIQP(HIMPC):
    """HIMPC with N = 1; the horizon of the settings is ignored.

    Δτ_k changes ẍ_{k+1} and ẋ_{k+1}, but not x_{k+1}: it cannot influence the printed position rows (32d).
    """

    def __init__(self, robot: Robot, settings: Settings) -> None:
        """Raises InputError if the settings name frames or joints that the robot does not have."""
        super().__init__(robot, replace(settings, horizon=_KNOTS))

    def configure(self, settings: Settings) -> None:
        """Applies new settings immediately, except the horizon. If they do not fit, it raises InputError and
        changes nothing."""
        super().configure(replace(settings, horizon=_KNOTS))
