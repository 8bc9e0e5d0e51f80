"""OSF: operational-space control with null-space projection on the nominal model, [9] of the HIMPC paper."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from himpc.controllers.null_space_control import projected_law
from himpc.controllers.one_step import Demand, Law, OneStepController
from himpc.formulation.settings import Settings
from robots import NominalModel, Robot

Array = NDArray[np.float64]


class OSF(OneStepController):
    """τ = N_n + Σ_i J_{i|prec}ᵀ Λ_{i|prec} (ẍ_i − J̇_i q̇ − acceleration of level i by the levels above).

    ẍ_i = ẍ_id − K_v (ẋ_i − ẋ_id) − K_p (x_i − x_id). Every level is feedback-linearised with the nominal M_n
    and N_n = C_n q̇ + G_n + F_n (`settings.nominal`), and decoupled from the levels above by dynamically
    consistent projection. Its closed loop is (4) with the gains of the tasks. The law imposes no bounds: the
    torque of the plan is its demand. Without `damping`, the demand grows without bound near a singularity of
    the projected Jacobian.
    """

    def __init__(self, robot: Robot, settings: Settings, damping: float = 0.0) -> None:
        """damping: as in `null_space_control.prioritised_torques`; 0 as in the paper."""
        self._damping = damping
        super().__init__(robot, settings)

    def _adopt(self, settings: Settings) -> None:
        self._nominal = NominalModel(self.robot, settings.nominal)

    def _law(self, q: Array, v: Array, a: Array, demands: list[Demand]) -> Law:
        M, bias = self._nominal.mass_matrix(q), self._nominal.bias(q, v)
        return projected_law(M, bias, self._tau_0, demands, self._damping)
