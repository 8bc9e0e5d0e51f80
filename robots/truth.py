"""The plant's own mechanics as a Pinocchio model: the robot's, changed as its settings say."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from robots.robot import Robot
from robots.settings import PlantSettings


def true_model(robot: Robot, settings: PlantSettings) -> pin.Model:
    """A copy of the robot's model with scaled inertias, payload, armature and gravity of the plant.

    Each joint's spatial inertia is scaled first; then the payload, a point mass at the tip, is added to the
    body that carries the tip. Raises InputError for a per-joint list of the wrong length.
    """
    model: pin.Model = robot.model.copy()
    scales = settings.per_joint("inertia_scale", robot.n)
    for joint, scale in enumerate(scales, start=1):
        nominal = robot.model.inertias[joint]
        model.inertias[joint] = pin.Inertia(nominal.mass * scale, nominal.lever, nominal.inertia * scale)
    if settings.payload_kg > 0.0:
        frame = robot.model.frames[robot.frame_id(robot.tip)]
        payload = pin.Inertia(settings.payload_kg, np.zeros(3), np.zeros((3, 3)))
        if frame.parentJoint > 0:
            model.inertias[frame.parentJoint] += frame.placement.act(payload)
    model.armature = settings.per_joint("armature", robot.n)
    if not settings.gravity:
        model.gravity.linear = np.zeros(3)
    return model


def joint_axis(model: pin.Model, joint: int) -> tuple[bool, np.ndarray]:
    """(prismatic, unit axis in the joint's frame) of a one-axis joint."""
    kind = model.joints[joint]
    data = kind.createData()
    kind.calc(data, np.zeros(1))
    motion = np.asarray(data.S, dtype=float).reshape(6)
    prismatic = bool(np.abs(motion[:3]).max() > 0.5)
    return prismatic, motion[:3] if prismatic else motion[3:]
