"""NHIMPC: HIMPC with the Jacobians taken along the current prediction, section VI-C of the paper."""

from __future__ import annotations

from himpc.controllers.himpc import HIMPC
from himpc.formulation.forms import Prepared
from himpc.formulation.settings import Settings
from himpc.tick.tick import CompiledTick
from robots import Robot

TOLERANCE = 1e-6
"""N·m: the iteration ends when no increment of any level changes by more than this."""
MAX_ITERATIONS = 10
"""Largest number of iterations; each solves all levels once."""


class NHIMPC(HIMPC):
    """HIMPC with J_i(q_{k+j|k}) in place of Ĵ_i^j, the simplification (29). The problem is then nonlinear,
    because q_{k+j|k} depends on Δτ.

    It is solved by sequential QPs: each iteration solves all levels with the Jacobians of the last
    prediction, and computes a new prediction by (18) from their increments. It ends when the increments
    change by at most `tolerance` or a level has no optimum. The result satisfies (15), (33) and all bounds
    with the Jacobians of its own prediction. The gradient of an exact SQP would also contain the derivative
    of the Jacobians: over N periods this term is of the order of (N T_s)² relative to the others.
    """

    def __init__(
        self,
        robot: Robot,
        settings: Settings,
        tolerance: float = TOLERANCE,
        max_iterations: int = MAX_ITERATIONS,
    ) -> None:
        """Raises InputError if the settings name frames or joints that the robot does not have.

        Args:
            robot: its geometry and limits are used.
            settings: as for HIMPC.
            tolerance: N·m, see TOLERANCE.
            max_iterations: ≥ 1, see MAX_ITERATIONS; with 1 the controller is HIMPC.
        """
        self.tolerance = tolerance
        self.max_iterations = max_iterations
        super().__init__(robot, settings)

    def _compile(self, settings: Settings, prepared: Prepared) -> CompiledTick:
        most = 1 if prepared.idle else self.max_iterations
        return CompiledTick(self.robot, settings, prepared, tolerance=self.tolerance, most=most)
