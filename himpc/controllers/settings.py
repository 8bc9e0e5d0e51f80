"""The settings that all torque-level controllers share."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

from himpc.catalog import ROUTES, Route
from himpc.limits import Limits
from himpc.qp import SOLVERS, Solver, is_installed
from himpc.stack import Stack, check_names
from robots import InputError, NominalSettings
from robots.errors import unknown_name

MAX_HORIZON = 60


@dataclass(frozen=True)
class Settings:
    """Everything about a torque-level controller that may change while the robot moves.

    Attributes:
        stack: levels, highest priority first.
        horizon: N ≥ 1 knots; 1 is HIQP.
        T_s: control period, s.
        M_bar: diagonal of M̄, one per joint, kg·m².
        limits: bounds to impose.
        route: "compiled" (the kernel of `himpc.tick`) or "explicit" (all rows as printed).
        solver: "daqp", "proxqp" or, with CasADi installed, "qpoases".
        R_on: what R in (31) weighs: the "torque" increments Δτ as printed, or the "acceleration" M̄⁻¹Δτ.
        damping: add the damping level whenever the enabled levels leave freedom.
        nominal: the dynamic model that model-based controllers use; incremental ones never read it.
    """

    stack: Stack
    M_bar: tuple[float, ...]
    horizon: int = 5
    T_s: float = 1e-3
    limits: Limits = field(default_factory=Limits)
    route: Route = "compiled"
    solver: Solver = "daqp"
    R_on: Literal["torque", "acceleration"] = "torque"
    damping: bool = True
    nominal: NominalSettings = field(default_factory=NominalSettings)

    def __post_init__(self) -> None:
        if not 1 <= self.horizon <= MAX_HORIZON:
            raise InputError(f"horizon is {self.horizon}: give a whole number from 1 to {MAX_HORIZON}")
        if not 1e-4 <= self.T_s <= 0.02:
            raise InputError(f"T_s is {self.T_s} s: give a period from 0.0001 to 0.02, e.g. 0.001")
        if not all(math.isfinite(value) and value > 0 for value in self.M_bar):
            raise InputError(f"M_bar is {list(self.M_bar)}: every entry must be a finite number above 0")
        for name, choices in (("route", ROUTES), ("solver", SOLVERS), ("R_on", ("torque", "acceleration"))):
            if getattr(self, name) not in choices:
                raise unknown_name(name, str(getattr(self, name)), choices)
        if not is_installed(self.solver):
            raise InputError(
                f"solver '{self.solver}' needs CasADi, which is not here: pip install casadi, or take daqp"
            )
        check_names(self.stack)
