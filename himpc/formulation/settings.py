"""The settings that all torque-level controllers share."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from himpc.limits import Limits
from himpc.qp import Solver, is_installed
from himpc.stack import Stack, check_names
from robots import InputError, NominalSettings
from robots.ranges import Range, check_fields

MAX_HORIZON = 60
Horizon = Annotated[int, Range(1, MAX_HORIZON)]
Period = Annotated[float, Range(1e-4, 0.02)]


@dataclass(frozen=True)
class Settings:
    """The settings of a torque-level controller; all of them may change while the robot moves.

    Attributes:
        stack: levels, highest priority first.
        horizon: N ≥ 1 knots; 1 is HIQP.
        T_s: control period, s.
        M_bar: diagonal of M̄, one per joint, kg·m².
        M_bar_adapt: himpc, hiqp, nhimpc and weighted fit M̄ to the payload that they estimate from the applied
            torques, see `himpc.controllers.adaptation`.
        limits: bounds to impose.
        solver: the solver of the QPs of himpc_printed and of hqp: "daqp", "proxqp" or, with CasADi installed,
            "qpoases". If no QP solver is used, only "daqp" is accepted, see `check_solver`.
        R_on: the quantity that R in (31) weighs: the "torque" increments Δτ as printed, or the "acceleration"
            M̄⁻¹Δτ (HQP uses M_n of its model in place of M̄).
        damping: whether the damping level is added if the enabled levels leave freedom.
        nominal: the dynamic model that model-based controllers and `M_bar_adapt` use; other controllers do
            not use it.
    """

    stack: Stack
    M_bar: Annotated[tuple[float, ...], Range(0.0, above=True)]
    M_bar_adapt: bool = False
    horizon: Horizon = 5
    T_s: Period = 1e-3
    limits: Limits = field(default_factory=Limits)
    solver: Solver = "daqp"
    R_on: Literal["torque", "acceleration"] = "torque"
    damping: bool = True
    nominal: NominalSettings = field(default_factory=NominalSettings)

    def __post_init__(self) -> None:
        check_fields(self)
        if not is_installed(self.solver):
            raise InputError(
                f"solver '{self.solver}' needs CasADi, which is missing: pip install casadi, or use daqp"
            )
        check_names(self.stack)


def check_solver(settings: Settings, used: bool) -> None:
    """Raises InputError for a QP solver other than the default if the controller uses no QP solver."""
    if settings.solver != "daqp" and not used:
        raise InputError(
            f"solver={settings.solver} changes nothing here: a QP solver is used by hqp and himpc_printed; "
            "choose one of these, or solver=daqp"
        )
