"""The scenes with dragged targets: EE position, EE orientation, posture, in this order of priority; the same
among objects; and a mobile manipulator, whose base is driven by forces."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from himpc.limits import Limits
from himpc.limits.limits import Avoidance
from himpc.stack import Level, freedom_left
from himpc.tasks import FrameOrientation, FramePosition, Posture
from lessons.scenes.scene import TorqueScene
from lessons.settings.torque import TorqueSettings
from robots import Plant, PlantSettings, Robot, load_robot, load_urdf_text, suggest_M_bar, tracking_bandwidth
from robots.floor import standing_floor
from robots.world import Ball, Post, Thing, World, table

TOUCHING = PlantSettings(contacts=True, joint_stops=True)
"""The plant of scenes with dragged targets: objects and the ends of the joints' ranges stop the robot."""
DRAGGED = Limits(stall_guard=True, avoidance=Avoidance(on=True))
"""The limits of scenes with dragged targets: a target may be in an object, in the robot or out of reach. The
scenes of the papers have the printed rows alone."""
PLANAR3_ARMATURE = {"joint_1": 0.05, "joint_2": 0.05, "joint_3": 0.03}
PLANAR3_PLANT = replace(TOUCHING, armature=tuple(PLANAR3_ARMATURE.values()))
"""The paper's M̄ = 0.033 requires geared motors: without armature the loop would be unstable."""
_HEAVY = 1.0  # kg·m²
"""Largest element of M̄ up to which R weighs torques, as printed. Q weighs m/s², so for a robot of two tonnes
R = 10 of its N·m would outweigh Q, and the robot would swing."""


def hold_of(name: str) -> TorqueScene:
    """Returns the hold scene of a catalog robot."""
    return replace(hold_robot(load_robot(name)), name=f"{name}-hold")


def hold(
    urdf: str | None,
    tip: str | None,
    urdf_text: str | bytes | None = None,
    within: Path | None = None,
    hold: tuple[str, ...] = (),
) -> TorqueScene:
    """Returns the hold scene of any robot: URDF path, catalog name or text of a URDF. within, hold: see
    `load_robot`.

    Raises:
        InputError: the URDF cannot be used, it has no frame with the name of the tip, or a pattern in `hold`
            fits no joint.
    """
    if urdf_text is not None:
        robot = load_urdf_text(urdf_text, tip, hold)
    else:
        robot = load_robot(str(urdf), tip, within, hold)
    return hold_robot(robot)


def hold_robot(robot: Robot) -> TorqueScene:
    """Returns the hold scene of a robot that is loaded already.

    For the iiwa this M̄ is smaller than the paper's. The paper's M̄ was tuned for one motion; in a few per
    cent of the work space (arm folded above the base) the loop is unstable with it. A dragged target can be
    anywhere.
    """
    if robot.name == "iiwa14":
        safe = suggest_M_bar(robot.model, robot.q_lower, robot.q_upper)
        robot = replace(robot, M_bar=np.minimum(robot.M_bar, safe))
    if robot.name == "planar3" and set(robot.joint_names) <= PLANAR3_ARMATURE.keys():
        armature = tuple(PLANAR3_ARMATURE[name] for name in robot.joint_names)
        return _hold(robot, replace(TOUCHING, armature=armature))
    return _hold(robot, TOUCHING)


def _hold(robot: Robot, plant: PlantSettings) -> TorqueScene:
    position_axes, orientation_axes = _free_axes(robot)
    K_p, K_v = gains(robot, plant)
    levels = [Level((FramePosition(name="position", axes=position_axes, K_p=K_p, K_v=K_v),))]
    if orientation_axes:
        levels.append(Level((FrameOrientation(name="orientation", axes=orientation_axes, K_p=K_p, K_v=K_v),)))
    levels.append(Level((Posture(name="posture", K_p=K_p, K_v=K_v),)))
    return TorqueScene(
        name="hold",
        title=f"{robot.name}: drag the target; position, then orientation, then posture",
        robot=robot,
        settings=TorqueSettings(
            stack=tuple(levels),
            M_bar=tuple(robot.M_bar),
            R_on="torque" if robot.M_bar.max() <= _HEAVY else "acceleration",
            limits=DRAGGED,
            plant=plant,
        ),
        references=lambda robot, stack: {},
        q_0=robot.home,
        v_0=np.zeros(robot.n),
        duration=4.0,
        world=standing_floor(robot),
    )


def gains(robot: Robot, plant: PlantSettings, T_s: float = 1e-3) -> tuple[float, float]:
    """Returns K_p and K_v = 2√K_p (critical damping) for the bandwidth that the robot's M̄ allows.

    With time-delay estimation the acceleration follows its desired value with a lag of about
    T_s/λ_min(M⁻¹M̄). With this lag (4) becomes a third-order loop, which is well damped if √K_p is at most
    half the inverse of the lag (`tracking_bandwidth`). √K_p is at most 10 1/s.
    """
    omega = min(tracking_bandwidth(Plant(robot, plant).mass_matrix(), robot.M_bar, T_s), 10.0)
    return float(f"{omega**2:.3g}"), 2 * omega


def _free_axes(robot: Robot) -> tuple[str, str]:
    """Returns the world axes along which the tip can move, and those about which it can turn. A planar arm
    cannot move along z."""

    def movable(task: type[FramePosition] | type[FrameOrientation], axis: str) -> bool:
        return freedom_left(robot, (Level((task(name="probe", axes=axis),)),)) < robot.n

    position = "".join(axis for axis in "xyz" if movable(FramePosition, axis)) or "xyz"
    return position, "".join(axis for axis in "xyz" if movable(FrameOrientation, axis))


TABLE_HEIGHT = 0.2
"""Height of the surface of the table, m."""
_BALL_RADIUS = 0.05


def iiwa14_table() -> TorqueScene:
    """The iiwa in front of a table and beside a post; a ball of 0.3 kg lies on the table."""
    ball = Ball("ball", (0.6, 0.3, TABLE_HEIGHT + _BALL_RADIUS), _BALL_RADIUS)
    things = (
        table("table", (0.7, 0.0), (0.6, 0.9), TABLE_HEIGHT),
        Thing(Post("post", (0.3, -0.25, 0.0), 0.9, 0.04)),
        Thing(ball, mass_kg=0.3),
    )
    return _with("iiwa14", "table", things)


def panda_post() -> TorqueScene:
    """The Panda beside a post."""
    return _with("panda", "post", (Thing(Post("post", (0.3, -0.25, 0.0), 0.9, 0.04)),))


def _with(robot: str, what: str, things: World) -> TorqueScene:
    scene = hold_of(robot)
    return replace(
        scene,
        name=f"{robot}-{what}",
        title=f"{scene.title}; with a {what}",
        world=(*scene.world, *things),
    )


def ridgeback_hold() -> TorqueScene:
    """`ridgeback-ur10-hold`: EE position, then the position of the base; all other motion is damped.

    The base's M̄ is half its mass, and the base has lower gains than the arm. R weighs accelerations. As
    printed, R would weigh forces of the base in N and torques of the arm in N·m.
    """
    robot = load_robot("ridgeback-ur10")
    levels = (
        Level((FramePosition(name="ee", K_p=100.0, K_v=20.0),)),
        Level((FramePosition(name="base", frame="base", axes="xy", K_p=16.0, K_v=8.0),)),
    )
    return TorqueScene(
        name="ridgeback-ur10-hold",
        title="Ridgeback and UR10 under HIMPC: drag the targets of hand and base; the hand comes first",
        robot=robot,
        settings=TorqueSettings(
            stack=levels, M_bar=tuple(robot.M_bar), R_on="acceleration", limits=DRAGGED, plant=TOUCHING
        ),
        references=lambda robot, stack: {},
        q_0=robot.home,
        v_0=np.zeros(robot.n),
        world=standing_floor(robot),
    )
