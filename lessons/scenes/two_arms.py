"""The scenes of the robot with two arms: dragged hands, hands that move as if they carried a tray, and
conflicting targets.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from himpc.kinematics.configuration import Configuration
from himpc.references import Waypoints
from himpc.stack import Level
from himpc.tasks import FrameOrientation, FramePosition, Posture, RelativeOrientation, RelativePosition
from lessons.events import Event, MoveTarget
from lessons.scenes.hold import DRAGGED, TOUCHING, gains
from lessons.scenes.scene import TorqueScene
from lessons.settings.torque import TorqueSettings
from robots import NominalSettings, Robot, load_robot
from robots.floor import standing_floor

RIGHT, LEFT = "right_gripper", "left_gripper"
SIDE = 0.12
"""Length of each edge of the square along which the hands move, m."""
START_S = 0.3
"""Time until the motion along the square starts, s."""
EDGE_S = 1.2
"""Time for each edge of the square, s."""
_SCRIPT_S = 0.05
"""Time between two targets of the tray in the script, s."""
PLANT = replace(TOUCHING, armature=0.1)
"""Geared motors: 0.1 kg·m² is the armature that MuJoCo Menagerie uses for arms of this size. Without
armature, the inertia of an empty gripper is so small that no constant M̄ suits both the wrist and the
shoulder.
"""
NOMINAL = NominalSettings(armature=0.1)
"""M̄ includes the armature, and so do the models of OSF and HQP. With the URDF alone, the inertia of the last
wrist joint is 6e-4 kg·m²: its motor then gets 1/180 of the torque that (4) requires, and the joint oscillates
around its target with 7 % of critical damping (2° after 4 s)."""
_M_BAR = (0.21, 0.87, 0.143, 0.242, 0.118, 0.134, 0.11) * 2
"""0.9 times the least 1/(M⁻¹)ᵢᵢ over the work space with this armature: the loop is stable everywhere."""
_APART = 0.15
"""Distance, m, by which the target of the left hand is moved away from the right hand."""


def baxter_hold() -> TorqueScene:
    """`baxter-hold`: positions of both hands, then their orientations, then the posture."""
    robot, K_p, K_v = _robot()
    levels = (
        Level(
            (
                FramePosition(name="right", frame=RIGHT, K_p=K_p, K_v=K_v),
                FramePosition(name="left", frame=LEFT, K_p=K_p, K_v=K_v),
            )
        ),
        Level(
            (
                FrameOrientation(name="right_turn", frame=RIGHT, K_p=K_p, K_v=K_v),
                FrameOrientation(name="left_turn", frame=LEFT, K_p=K_p, K_v=K_v),
            )
        ),
        Level((Posture(name="posture", K_p=K_p, K_v=K_v),)),
    )
    return _scene(
        robot, "baxter-hold", "Baxter: drag both hands; their positions come before orientations", levels
    )


def baxter_tray() -> TorqueScene:
    """`baxter-tray`: level 1 is the pose of the left hand relative to the right hand. Level 2 is the position
    of the tray, which the right hand defines, and keeps the tray horizontal. Level 3 is the posture. A script
    moves the hands along a square once.

    The tray is not simulated: it adds no load and no forces between the hands, and only level 1 keeps the
    hands together."""
    robot, K_p, K_v = _robot()
    levels = (
        Level(_grip(K_p, K_v)),
        Level(
            (
                FramePosition(name="tray", frame=RIGHT, K_p=K_p, K_v=K_v),
                FrameOrientation(name="level", frame=RIGHT, axes="xy", K_p=K_p, K_v=K_v),
            )
        ),
        Level((Posture(name="posture", K_p=K_p, K_v=K_v),)),
    )
    corners = _home(robot, RIGHT) + SIDE * np.array([[0, 0, 0], [0, 0, 1], [0, 1, 1], [0, 1, 0], [0, 0, 0]])
    way = Waypoints(corners, np.array([START_S + EDGE_S * k for k in range(5)]))
    times = [START_S + _SCRIPT_S * k for k in range(1, round(4 * EDGE_S / _SCRIPT_S) + 1)]
    events = tuple((t, MoveTarget("tray", tuple(way.preview(t, 1e-3, 1).value.tolist()))) for t in times)
    title = "Baxter moves as if it carried a tray: only level 1 keeps the hands together"
    return _scene(robot, "baxter-tray", title, levels, events, START_S + 4 * EDGE_S + 0.5)


def baxter_conflict() -> TorqueScene:
    """`baxter-conflict`: the hands keep their relative pose (level 1), the right hand stays (level 2), and
    the target of the left hand (level 3) is elsewhere and cannot be reached."""
    robot, K_p, K_v = _robot()
    levels = (
        Level(_grip(K_p, K_v)),
        Level((FramePosition(name="right", frame=RIGHT, K_p=K_p, K_v=K_v),)),
        Level((FramePosition(name="left", frame=LEFT, K_p=K_p, K_v=K_v),)),
        Level((Posture(name="posture", K_p=K_p, K_v=K_v),)),
    )
    away = _home(robot, LEFT) + np.array([0.0, _APART, 0.0])
    events = ((0.5, MoveTarget("left", tuple(away.tolist()))),)
    title = "Baxter: the hands keep their relative pose, but have targets at two different places"
    return _scene(robot, "baxter-conflict", title, levels, events)


def _robot() -> tuple[Robot, float, float]:
    """Returns the robot with the M̄ for its geared motors, and K_p and K_v for this M̄ and these motors."""
    robot = replace(load_robot("baxter"), M_bar=np.array(_M_BAR))
    return robot, *gains(robot, PLANT)


def _grip(K_p: float, K_v: float) -> tuple[RelativePosition, RelativeOrientation]:
    return (
        RelativePosition(name="grip", frame=LEFT, root=RIGHT, K_p=4 * K_p, K_v=2 * K_v),
        RelativeOrientation(name="grip_turn", frame=LEFT, root=RIGHT, K_p=4 * K_p, K_v=2 * K_v),
    )


def _home(robot: Robot, frame: str) -> np.ndarray:
    home = Configuration(robot, robot.model.createData(), robot.home, np.zeros(robot.n))
    return home.placement(frame).translation


def _scene(
    robot: Robot,
    name: str,
    title: str,
    levels: tuple[Level, ...],
    events: tuple[tuple[float, Event], ...] = (),
    duration: float = 4.0,
) -> TorqueScene:
    return TorqueScene(
        name=name,
        title=title,
        robot=robot,
        settings=TorqueSettings(
            stack=levels, M_bar=tuple(robot.M_bar), limits=DRAGGED, nominal=NOMINAL, plant=PLANT
        ),
        references=lambda robot, stack: {},
        q_0=robot.home,
        v_0=np.zeros(robot.n),
        duration=duration,
        events=events,
        world=standing_floor(robot),
    )
