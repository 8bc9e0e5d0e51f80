"""TDEOSF: operational-space control with time-delay estimation, [10] of the HIMPC paper."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from himpc.controllers.null_space_control import projected_law
from himpc.controllers.one_step import Demand, Law, OneStepController
from himpc.formulation.settings import Settings
from robots import Robot

Array = NDArray[np.float64]


class TDEOSF(OneStepController):
    """OSF's law with M̄ as the inertia and Ĥ_q = τ₀ − M̄ q̈₀ for all other terms of (6): no model is used.

    τ = Ĥ_q + Σ_i J_{i|prec}ᵀ Λ̄_{i|prec} (…), where both factors are projected with M̄. q̈₀ is the backward
    difference of q̇, τ₀ the applied torque; J̇_i q̇ is exact kinematics (Remarks 2 and 3). Gains, bounds and
    damping are those of `OSF`.
    """

    incremental = True

    def __init__(self, robot: Robot, settings: Settings, damping: float = 0.0) -> None:
        """damping: as in `null_space_control.prioritised_torques`; 0 as in the paper."""
        self._damping = damping
        super().__init__(robot, settings)

    def _adopt(self, settings: Settings) -> None:
        self._M_bar = np.array(settings.M_bar)

    def _law(self, q: Array, v: Array, a: Array, demands: list[Demand]) -> Law:
        bias = self._tau_0 - self._M_bar * a
        return projected_law(np.diag(self._M_bar), bias, self._tau_0, demands, self._damping)
