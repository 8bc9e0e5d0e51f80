"""The names of the scenes with one line each, for lists and menus. No scene is loaded."""

from __future__ import annotations

SCENES: dict[str, str] = {
    "iiwa14-hold": "KUKA iiwa 14: drag the target; position, then orientation, then posture",
    "panda-hold": "Franka Panda: the same three levels",
    "planar3-hold": "planar 3-joint arm: the same three levels, in its plane",
    "ridgeback-ur10-hold": "Ridgeback and UR10 at torque level: drag hand and base; the hand comes first",
    "iiwa14-table": "KUKA iiwa 14 at a table with a ball, beside a post: press on them, or keep clear",
    "panda-post": "Franka Panda beside a post",
    "baxter-hold": "Baxter, two arms: drag both hands; their positions come before their orientations",
    "baxter-tray": "Baxter's hands move along a square as if they carried a tray; the grip is level 1",
    "baxter-conflict": "Baxter's hands keep their relative pose, but have targets at two different places",
    "hold": "any robot: the same three levels; levels without freedom have no effect (needs --urdf)",
    "planar3-plane": "the same arm, N = 1: the whole QP is drawn; the wrist's x ranks above two joints",
    "planar3-circle": "planar 3-joint arm on RT1 of the HIMPC paper: a circle while joint 1 swings a little",
    "planar3-conflict": "the same arm on RT2: joint 1 swings so far that the hand cannot keep to the circle",
    "planar3-singular": "the same arm on RT3: two circles through the straight, singular arm",
    "iiwa14-circle": "KUKA iiwa 14 on RT4 of the HIMPC paper: the upright hand on a circle, joint 1 swings",
    "iiwa14-circle-paper": "the same circle as the paper most likely ran it: weightless, no velocity limits",
}
"""The torque-level scenes."""

VELOCITY_SCENES: dict[str, str] = {
    "ridgeback-ur10-drag": "Ridgeback and UR10: drag the targets of hand and base; the hand comes first",
    "ridgeback-ur10-square": "the HTMPC paper's test: the hand stays, the base is sent out of reach and back",
    "ridgeback-ur10-waypoints": "two places for the hand; the base has no waypoint at the first one (Fig. 8)",
    "ridgeback-ur10-delivery": "a delivery round to three people, four times (Fig. 9)",
    "ridgeback-ur10-handover": "the hand waits until the ball is taken; people move meanwhile",
    "ridgeback-ur10-cluttered": "the base drives past obstacles that it must avoid",
    "ridgeback-ur10-perception": "for a while, a crate beside the path is wrongly reported on the path",
    "iiwa14-htmpc": "KUKA iiwa 14 under HTMPC: position, then orientation",
    "panda-htmpc": "Franka Panda under HTMPC: position, then orientation",
}
"""The velocity-level scenes."""

ALL_SCENES: dict[str, str] = SCENES | VELOCITY_SCENES
"""The scenes of both levels."""
