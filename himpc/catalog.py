"""Names and one-line descriptions of the controllers, for lists and menus. No controller is
loaded."""

from __future__ import annotations

CONTROLLERS: dict[str, str] = {
    "himpc": "hierarchical incremental MPC: torque level, strict priorities, no dynamic model",
    "hiqp": "HIMPC with a horizon of one knot: it optimises the next step only",
    "nhimpc": "HIMPC with the Jacobians along its own prediction: sequential QPs until they converge",
    "weighted": "HIMPC without priorities: one cost for all tasks, in which a level is weighted by its Q",
    "osf": "operational-space control with null-space projection on the nominal model; no bounds, no damping",
    "tdeosf": "OSF with time-delay estimation in place of the model; no bounds, no damping",
    "osf_damped": "OSF with damped least squares near singularities; the paper's OSF has no damping",
    "tdeosf_damped": "TDEOSF with damped least squares near singularities",
    "hqp": "one-step hierarchical QP on the nominal model, within the torque bounds",
    "himpc_filtered": "HIMPC without rows of distances; a further QP changes its torque to keep distances",
    "himpc_printed": "HIMPC as it is printed, on one page of NumPy: the same torques, a hundred times slower",
}
"""Torque-level controllers: name and description."""

WITH_MODEL = ("osf", "osf_damped", "hqp")
"""Torque-level controllers that use a dynamic model in place of time-delay estimation."""

VELOCITY_CONTROLLERS: dict[str, str] = {
    "htmpc": "hierarchical-task MPC: velocity level, lexicographic, previews its references",
    "htmpc_wpt": "HTMPC without preview: it receives a trajectory as separate waypoints",
    "stmpc": "single-task MPC: it solves only the first task of the window",
    "htidkc": "hierarchical-task inverse differential kinematics: cascaded QPs, no prediction",
    "placo": "inverse kinematics by the library placo: one QP, only level 1 is strict, no prediction",
}
"""Velocity-level controllers: name and description."""

OWN_METHOD = "goldfarb-idnani"
"""The active-set method of the compiled code, which needs no QP solver."""


def qp_method(controller: str, solver: str) -> str | None:
    """Returns the method that solves the QPs of a controller: `OWN_METHOD`, the solver, or None if the
    controller solves no QP. If `OWN_METHOD` finds no optimum of a level, DAQP may be used in addition."""
    if controller == "placo":
        return "placo"
    if controller in ("hqp", "himpc_printed", "htidkc"):
        return solver
    if controller in VELOCITY_CONTROLLERS:
        return OWN_METHOD if solver == "daqp" else solver
    own = controller in ("himpc", "hiqp", "nhimpc", "weighted", "himpc_filtered")
    return OWN_METHOD if own else None
