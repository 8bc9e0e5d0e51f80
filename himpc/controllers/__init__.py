"""Controllers: one file, one class each."""

from himpc.controllers.himpc import HIMPC, Settings

CONTROLLERS = {"himpc": "hierarchical incremental MPC: torque level, strict priorities, no dynamic model"}

__all__ = ["CONTROLLERS", "HIMPC", "Settings"]
