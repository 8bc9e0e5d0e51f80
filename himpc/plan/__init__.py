"""The plan of one control tick, and its conversion to a row of telemetry."""

from himpc.plan.plan import AtOnce, Behind, Binding, Evidence, Plan, SolvedLevel
from himpc.plan.row import as_numbers, write_levels, write_plan, write_reference

__all__ = [
    "AtOnce",
    "Behind",
    "Binding",
    "Evidence",
    "Plan",
    "SolvedLevel",
    "as_numbers",
    "write_levels",
    "write_plan",
    "write_reference",
]
