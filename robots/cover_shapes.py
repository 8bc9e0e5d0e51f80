"""The capsules of a robot's cover and the shapes that they must not touch, as arrays: objects of the world,
and the other capsules of the robot."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pinocchio as pin

from robots.arrays import Array, Mask
from robots.collision import CAPSULE, Floor, Surroundings, WorldShape, base_joint, shape_arrays
from robots.geometry import Capsule, Cover
from robots.per_robot import per_robot
from robots.robot import Robot

_POSTURES = 24
_STILL = 1e-3
"""If the height of a capsule varies by less than this, m, over all postures, no motion can keep the capsule
away from the floor."""


def cover_surroundings(robot: Robot, cover: Cover, shapes: Sequence[WorldShape]) -> Surroundings:
    """Collects the capsules of a robot's cover and the shapes. The shapes are first the objects of the world,
    in their order, and then the same capsules again.

    Every pair of capsules is checked once, except pairs on one body and pairs of bodies that the cover leaves
    out. Capsules that do not move are not checked against the world. A capsule is not checked against a floor
    if its height never changes, or if it reaches into the floor at home.
    """
    capsules = cover.capsules
    joint = np.array([each.joint for each in capsules], np.intp)
    start = np.array([each.start for each in capsules], float).reshape(-1, 3)
    span = np.array([each.end for each in capsules], float).reshape(-1, 3) - start
    radius = np.array([each.radius for each in capsules])
    S, B = len(capsules), len(shapes)
    meets = np.zeros((B + S, S), np.bool_)
    for place, shape in enumerate(shapes):
        meets[place] = joint > 0
        if isinstance(shape, Floor):
            meets[place] &= (joint > base_joint(robot)) & _reaches(robot, capsules, shape.height)
    left_out = {(each.first, each.second) for each in cover.excluded}
    for i, k in combinations(range(S), 2):
        pair = min(joint[i], joint[k]), max(joint[i], joint[k])
        meets[B + k, i] = pair[0] != pair[1] and pair not in left_out
    at = shape_arrays(shapes)
    return Surroundings(
        links=tuple(each.link for each in capsules),
        joint=joint,
        centre=start,
        span=span,
        radius=radius,
        names=(*(shape.name for shape in shapes), *(each.link for each in capsules)),
        kind=np.array([*at.kind, *[CAPSULE] * S], np.intp),
        carrier=np.array([*[0] * B, *joint], np.intp),
        turn=np.concatenate([at.turn, np.tile(np.eye(3), (S, 1, 1))]),
        middle=np.concatenate([at.middle, start]),
        half=np.concatenate([at.half, span]),
        thickness=np.concatenate([at.thickness, radius]),
        meets=meets,
    )


def placements(shapes: Sequence[WorldShape]) -> tuple[Array, Array]:
    """Returns the rows of `Surroundings.turn` and `middle` for objects of the world, (B, 3, 3) and (B, 3)
    m."""
    at = shape_arrays(shapes)
    return at.turn, at.middle


@per_robot
def _reaches(robot: Robot, capsules: tuple[Capsule, ...], height: float) -> Mask:
    """Returns whether the height of each capsule above a floor depends on the posture and is positive at
    home, (S,)."""
    rng = np.random.default_rng(0)
    low = np.where(np.isfinite(robot.q_lower), robot.q_lower, -np.pi)
    high = np.where(np.isfinite(robot.q_upper), robot.q_upper, np.pi)
    data, heights = robot.model.createData(), np.empty((_POSTURES + 1, len(capsules)))
    for row, q in enumerate([robot.home, *rng.uniform(low, high, (_POSTURES, robot.n))]):
        pin.forwardKinematics(robot.model, data, q)
        for place, each in enumerate(capsules):
            ends = [data.oMi[each.joint].act(np.array(end))[2] for end in (each.start, each.end)]
            heights[row, place] = min(ends) - each.radius - height
    return (np.ptp(heights, axis=0) > _STILL) & (heights[0] > 0.0)
