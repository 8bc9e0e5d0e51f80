"""The joints of a Pinocchio model, and those of them that follow (mimic) others.

Each joint that follows another one has no coordinate of its own: it moves by factor · q of its leader. All
other joints have one coordinate each, so that nq = nv = n, and the model has n joints and the followers."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from robots.arrays import Array, Indices


def own_joints(model: pin.Model) -> tuple[int, ...]:
    """Returns the indices of the joints with a coordinate of their own, in the order of the coordinates."""
    return tuple(joint for joint in range(1, model.njoints) if model.nvs[joint] == 1)


def joint_names(model: pin.Model) -> tuple[str, ...]:
    """Returns the names of the joints with a coordinate of their own."""
    return tuple(model.names[joint] for joint in own_joints(model))


def joint_axis(model: pin.Model, joint: int) -> tuple[bool, Array]:
    """Returns whether a one-axis joint is prismatic, and its unit axis. The axis is given in the joint's
    frame, in which it is constant. Along the axis a positive coordinate moves the joint forwards."""
    prismatic, motion, length = _motion(model, joint)
    return prismatic, motion if length == 1.0 else motion / length


def motions(model: pin.Model) -> tuple[Indices, Array]:
    """Returns for each joint, (J,), the index of the coordinate that moves it, and the motion along its axis
    per motion of the coordinate: 1 for a joint with a coordinate of its own, > 0. The world has 0 and 1."""
    column, factor = np.zeros(model.njoints, np.intp), np.ones(model.njoints)
    for joint in range(1, model.njoints):
        column[joint] = model.idx_vs[joint]
        if model.nvs[joint] == 0:
            factor[joint] = _motion(model, joint)[2]
    return column, factor


def joints_at_zero(model: pin.Model) -> list[pin.SE3]:
    """Returns the placement of each joint relative to its parent at q = 0, the world first. For a joint that
    follows another one it contains the offset."""
    data = model.createData()
    pin.forwardKinematics(model, data, np.zeros(model.nq))
    placements = zip(model.jointPlacements, data.liMi, model.nvs, strict=True)
    return [(moved if k and nv == 0 else still).copy() for k, (still, moved, nv) in enumerate(placements)]


def coupling(model: pin.Model) -> Array:
    """Returns G, (J − 1, n): G q is the motion of every joint from q = 0 at the coordinates q (n,), and G v
    are their velocities."""
    column, factor = motions(model)
    G = np.zeros((model.njoints - 1, model.nv))
    G[np.arange(len(G)), column[1:]] = factor[1:]
    return G


def followed(model: pin.Model, follower: str, leader: str, factor: float, offset: float) -> pin.Model:
    """Returns the model in which the joint `follower` is at factor · q + offset, rad or m, where q is the
    coordinate of the joint `leader`, whose index must be smaller."""
    return pin.transformJointIntoMimic(
        model, model.getJointId(leader), model.getJointId(follower), factor, offset
    )


def _motion(model: pin.Model, joint: int) -> tuple[bool, Array, float]:
    """Returns whether a joint is prismatic, the motion for a coordinate that grows by 1, and its length."""
    motion = np.asarray(model.joints[joint].createData().S, dtype=float).reshape(6)
    along, about = motion[:3], motion[3:]
    prismatic = bool(np.abs(along).max() > np.abs(about).max())
    found = along if prismatic else about
    return prismatic, found, 1.0 if model.nvs[joint] == 1 else float(np.linalg.norm(found))


def chain_length(model: pin.Model, frame: int, from_world: bool = False) -> float:
    """Returns the length of the chain from the first joint, or from the world's origin, through all joints to
    a frame with this index, m."""
    joints = [joint for joint in model.supports[model.frames[frame].parentJoint] if joint > 0]
    steps = [model.jointPlacements[joint].translation for joint in (joints if from_world else joints[1:])]
    return sum(float(np.linalg.norm(step)) for step in (*steps, model.frames[frame].placement.translation))
