"""HIQP: HIMPC with a horizon of one knot, the local optimum with which section V of the paper compares
HIMPC."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from himpc.controllers.himpc import HIMPC
from himpc.formulation.settings import Settings
from himpc.plan import Plan
from himpc.references import Preview
from robots import Robot

Array = NDArray[np.float64]

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

    def step(
        self, q: Array, v: Array, previews: Mapping[str, Preview], tau_applied: Array | None = None
    ) -> Plan:
        """Computes one control period, see `HIMPC.step`; it reads only the next knot of the previews."""
        if self.kernel is None:
            previews = {name: _next(each) for name, each in previews.items()}
        return super().step(q, v, previews, tau_applied)


def _next(preview: Preview) -> Preview:
    ahead = slice(_KNOTS + 1)
    return Preview(
        preview.value, preview.displacement[ahead], preview.velocity[ahead], preview.acceleration[ahead]
    )
