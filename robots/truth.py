"""The plant's mechanics as a Pinocchio model: the robot's model, changed by the plant settings."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from robots.joints import joint_axis, motions
from robots.robot import Robot
from robots.settings import PlantSettings


def true_model(robot: Robot, settings: PlantSettings) -> pin.Model:
    """Returns a copy of the robot's model with the plant's masses, inertias, payload, armature and gravity.

    First, the body of each joint is scaled, that of a follower as its leader's. Then the payload, a point
    mass at the tip, is added to the body that carries the tip. Raises InputError for a per-joint list of the
    wrong length.
    """
    model: pin.Model = robot.model.copy()
    masses, inertias = settings.per_joint("mass_scale", robot.n), settings.per_joint("inertia_scale", robot.n)
    column, _ = motions(model)
    for joint in range(1, model.njoints):
        mass, inertia = masses[column[joint]], inertias[column[joint]]
        nominal = robot.model.inertias[joint]
        model.inertias[joint] = pin.Inertia(nominal.mass * mass, nominal.lever, nominal.inertia * inertia)
    if settings.payload_kg > 0.0:
        frame = robot.model.frames[robot.frame_id(robot.tip)]
        payload = pin.Inertia(settings.payload_kg, np.zeros(3), np.zeros((3, 3)))
        if frame.parentJoint > 0:
            model.inertias[frame.parentJoint] += frame.placement.act(payload)
    armature = settings.per_joint("armature", robot.n)
    model.armature = np.where(armature > 0.0, armature, robot.model.armature)
    if not settings.gravity:
        model.gravity.linear = np.zeros(3)
    return model


def encoder_resolution(robot: Robot, settings: PlantSettings) -> np.ndarray:
    """Returns the resolution of each joint's sensor, (n,) rad; 0 is ideal. Sensors of prismatic joints are
    always ideal."""
    revolute = [not joint_axis(robot.model, joint)[0] for joint in robot.joints]
    return np.where(revolute, np.radians(settings.encoder_resolution_deg), 0.0)


def pose(placement: pin.SE3) -> dict[str, np.ndarray]:
    """Returns the position (3,) m and the unit quaternion (w, x, y, z), by their names in MuJoCo's
    specification."""
    # The quaternion is built from a vector: each pin.Quaternion of a matrix leaks 80 bytes.
    x, y, z, w = pin.Quaternion(pin.SE3ToXYZQUAT(placement)[3:]).normalized().coeffs()
    return {"pos": placement.translation, "quat": np.array([w, x, y, z])}


def inertial(inertia: pin.Inertia) -> tuple[float, np.ndarray, list[float]]:
    """Returns the mass (kg), the centre of mass (3,) m, and Ixx, Iyy, Izz, Ixy, Ixz, Iyz (kg·m²) about this
    centre."""
    I = inertia.inertia
    return inertia.mass, inertia.lever, [I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]]
