"""The plan of one control tick, and its conversion to a row of telemetry."""

from himpc.plan.plan import AtOnce, Behind, Binding, Evidence, Plan, TickPlan
from himpc.plan.row import write_plan

__all__ = ["AtOnce", "Behind", "Binding", "Evidence", "Plan", "TickPlan", "write_plan"]
