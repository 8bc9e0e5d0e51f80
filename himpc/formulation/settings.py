"""The settings that all torque-level controllers share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Annotated, Any, Literal

from himpc.limits import Limits
from himpc.limits.limits import Avoidance
from himpc.qp import Solver, is_installed
from himpc.stack import Level, Stack, check_names
from himpc.tasks import Task
from robots import InputError, NominalSettings
from robots.ranges import Range, Shown, check_fields

MAX_HORIZON = 60


@dataclass(frozen=True)
class Settings:
    """The settings of a torque-level controller; all of them may change while the robot moves.

    Attributes:
        stack: levels, highest priority first.
        M_bar: diagonal of M̄, one per joint, kg·m².
        M_bar_adapt: himpc, hiqp, nhimpc and weighted fit M̄ to the payload that they estimate from the applied
            torques, see `himpc.controllers.adaptation`.
        solver: the solver of the QPs of himpc_printed and of hqp: "daqp", "proxqp" or, with CasADi installed,
            "qpoases". If no QP solver is used, only "daqp" is accepted, see `check_solver`.
        R_on: the quantity that R in (31) weighs: the "torque" increments Δτ as printed, or the "acceleration"
            M̄⁻¹Δτ (HQP uses M_n of its model in place of M̄).
        damping: whether the damping level is added if the enabled levels leave freedom.
        nominal: the dynamic model that model-based controllers and `M_bar_adapt` use; other controllers do
            not use it.
    """

    stack: Stack
    # fmt: off
    M_bar: Annotated[tuple[float, ...], Range(1e-12, 1e12), Shown(
        "M̄", "The diagonal of M̄, one number per joint, before scaling", "kg·m²")]
    M_bar_adapt: Annotated[bool, Shown(
        "M̄ adapts to the payload", "The controller estimates the payload from the torque against gravity, "
        "and sets M̄ as large as the nominal model with that payload allows", tries=("true", "false"),
        name="M̄ adapts", group="Inertia estimate M̄")] = False
    horizon: Annotated[int, Range(1, MAX_HORIZON), Shown(
        "N", "Number of knots of the prediction horizon; 1 is the inverse dynamics hierarchy", low=1, high=30,
        tries=("1", "2", "5", "10", "20"), name="horizon N", group="Horizon")] = 5
    T_s: Annotated[float, Range(1e-4, 0.02), Shown(
        "T_s", "Control period; also the time allowed for each control step. Above 1 ms, the longest period "
        "depends on M̄: with a longer one the robot would swing", "s", 0.5, 5.0, 0.5, page_unit="ms",
        factor=1000.0, tries=("0.002", "0.0005", "0.001"), name="control period T_s, s",
        group="Horizon")] = 1e-3
    limits: Limits = field(default_factory=Limits)
    solver: Annotated[Solver, Shown(
        "QP solver", "Solver of the QPs of hqp and himpc_printed. Other controllers accept daqp only. "
        "qpoases needs the extra 'bench'", group="Solver")] = "daqp"
    R_on: Annotated[Literal["torque", "acceleration"], Shown(
        "R weighs", "Quantity that R weighs: Δτ as printed, or M̄⁻¹Δτ", group="Solver")] = "torque"
    damping: Annotated[bool, Shown(
        "Damp what no level controls", "R weighs changes of torque only, so a motion without a task keeps "
        "its torque and does not stop after a push. The last level brings this motion to rest. To see the "
        "effect, switch it off and push the robot.", tries=("false", "true"), name="damping level")] = True
    # fmt: on
    nominal: NominalSettings = field(default_factory=NominalSettings)

    def __post_init__(self) -> None:
        check_fields(self)
        if self.solver != "daqp" and not is_installed(self.solver):
            raise InputError(
                f"solver '{self.solver}' needs CasADi, which is missing: pip install casadi, or use daqp"
            )
        check_names(self.stack)


WEIGHTS: Mapping[type, tuple[str, ...]] = {Level: ("Q", "R")}
NUMBERS: Mapping[type, tuple[str, ...]] = WEIGHTS | {
    Settings: ("M_bar",),
    Task: ("K_p", "K_v"),
    Limits: ("torque_scale", "velocity_scale", "velocity_approach", "torque_rate"),
    Avoidance: ("d_safe", "margin", "reaction", "deceleration", "pull", "velocity_margin"),
}
"""The numbers that a controller replaces without being built anew, by the class of their owner. All other
settings are the structure of the stack and of the horizon."""


def same_structure(one: Any, other: Any, numbers: Mapping[type, tuple[str, ...]] = NUMBERS) -> bool:
    """Returns whether two settings, or parts of them, differ at most in `numbers`. A number that is zero in
    one of them only is a difference in structure, since zero switches some of them off."""
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, tuple):
        pairs = zip(one, other, strict=False)
        return len(one) == len(other) and all(same_structure(*pair, numbers) for pair in pairs)
    if not is_dataclass(one):
        return one == other
    free = {name for owner, names in numbers.items() if isinstance(one, owner) for name in names}
    return all(
        bool(a) == bool(b) if name in free else same_structure(a, b, numbers)
        for name, a, b in (
            (each.name, getattr(one, each.name), getattr(other, each.name)) for each in fields(one)
        )
    )


def check_solver(settings: Settings, used: bool) -> None:
    """Raises InputError for a QP solver other than the default if the controller uses no QP solver."""
    if settings.solver != "daqp" and not used:
        raise InputError(
            f"solver={settings.solver} changes nothing here: a QP solver is used by hqp and himpc_printed; "
            "choose one of these, or solver=daqp"
        )
