"""The straight parts of a robot's bodies, from joint to joint, for bodies without shapes in the
description."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from robots.joints import chain_length

Colour = tuple[int, int, int]
BODY: Colour = (222, 226, 231)
DRUM: Colour = (74, 82, 94)
TIP: Colour = (236, 122, 44)
_SHORTEST = 0.004  # m; shorter parts are left out
_SLENDER = 0.05  # capsule radius divided by the length of the whole chain


class Limb(NamedTuple):
    """A straight part of a body.

    Attributes:
        joint: Pinocchio index of the joint that moves the body; 0 for the pedestal from the floor to the
            first joint.
        k: number of this part among the parts of the same body.
        end: (3,), m; the part extends from the origin of the joint's frame to this point.
        radius: m.
        colour: red, green and blue, each from 0 to 255.
    """

    joint: int
    k: int
    end: np.ndarray
    radius: float
    colour: Colour


def limbs(model: pin.Model, tip: int, drawn: set[int]) -> Iterator[Limb]:
    """Yields the limbs, longer than 4 mm, of every body of the model that is not in `drawn`. tip: frame
    index of the end-effector."""
    thickness = _thickness(model, tip)
    for joint in range(model.njoints):
        if joint in drawn:
            continue
        ends = _ends(model, tip, joint)
        if joint == 0 and not drawn:
            for end, _ in ends[:1]:
                yield Limb(0, 0, _foot(np.asarray(end), 1.5 * thickness), 1.5 * thickness, DRUM)
            continue
        radius = joint_radius(model, tip, joint)
        for k, (end, colour) in enumerate(ends):
            length = float(np.linalg.norm(end))
            if length >= _SHORTEST:
                yield Limb(joint, k, np.asarray(end), min(radius, 0.45 * length), colour)


def _ends(model: pin.Model, tip: int, joint: int) -> list[tuple[np.ndarray, Colour]]:
    """Returns the points to which a joint's body extends: its child joints and the end-effector, in the
    joint's frame, m."""
    children = [k for k in range(1, model.njoints) if model.parents[k] == joint]
    ends: list[tuple[np.ndarray, Colour]] = [(model.jointPlacements[k].translation, BODY) for k in children]
    if model.frames[tip].parentJoint == joint:
        ends.append((model.frames[tip].placement.translation, TIP))
    if joint > 0 and not any(np.linalg.norm(end) >= _SHORTEST for end, _ in ends):
        ends.append((_farthest(model, joint), BODY))
    return ends


def _farthest(model: pin.Model, joint: int) -> np.ndarray:
    """Returns the position of the farthest frame that a body without child joints carries, in the frame of
    the body's joint, m."""
    own = [frame.placement.translation for frame in model.frames if frame.parentJoint == joint]
    return max(own, key=lambda at: float(np.linalg.norm(at)))


def _foot(top: np.ndarray, radius: float) -> np.ndarray:
    """Returns the position, (3,) m, of the upper end of a column from the floor to the first joint. If this
    joint is on the floor, returns the lower end of a flat foot below the joint."""
    return top if float(np.linalg.norm(top)) > 0.5 * radius else np.array([0.0, 0.0, -0.5 * radius])


def joint_radius(model: pin.Model, tip: int, joint: int) -> float:
    """Returns the radius of a body's capsules, m. It decreases towards the tip, which makes the chain easier
    to see."""
    thickness = _thickness(model, tip)
    depth = len(model.supports[joint]) - 1
    deepest = max(len(support) for support in model.supports) - 1
    return thickness * (1.0 - 0.4 * depth / max(deepest, 1))


def _thickness(model: pin.Model, tip: int) -> float:
    return _SLENDER * max(chain_length(model, tip, from_world=True), 0.05)
