"""HIMPC as it is printed: one page of NumPy and a general QP solver in place of the compiled tick."""

from __future__ import annotations

from typing import final

from himpc.controllers.himpc import HIMPC
from himpc.controllers.printed_tick import PrintedTick
from himpc.formulation.forms import Prepared
from himpc.formulation.settings import Settings


@final
class PrintedHIMPC(HIMPC):
    """HIMPC by the equations of `himpc.printed`. The torques equal those of `HIMPC` up to rounding, and a
    step takes about a hundred times as long. Guards, ramps, fades and adaptation are those of `HIMPC`."""

    solves = True

    def _compile(self, settings: Settings, prepared: Prepared) -> PrintedTick:
        return PrintedTick(self.robot, settings, prepared)
