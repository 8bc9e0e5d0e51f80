"""What one control tick decided, and how it becomes a row of telemetry."""

from himpc.plan.plan import AtOnce, Binding, Evidence, Plan

__all__ = ["AtOnce", "Binding", "Evidence", "Plan"]
