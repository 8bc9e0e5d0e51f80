"""Makes the cover of a robot, and finds the pairs of bodies whose distance is not checked."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pinocchio as pin

from robots.covering.covered import patches
from robots.covering.covering import covering
from robots.geometry import Capsule, CollisionModel, Cover, Excluded, Solid, point
from robots.mechanics.exclusions import Bodies, collision_model, touching, touching_often
from robots.per_robot import per_robot
from robots.robot import Robot

NEAR = 0.01
"""Pairs of bodies whose capsules are nearer than this at home, m, are left out: they cannot keep a safe
distance."""
USELESS = 0.5
"""Two bodies are left out if their capsules touch in more than this share of the postures without contact."""

_TAPER = 0.4
"""The weight of the capsules of the base is 1 minus this value. The weights increase from 0.6 at the base to
1 at a last link."""
_CLOSE = 2.5
"""Factor on the weight of two bodies if their capsules are too near to each other, but their solids are
not."""


@per_robot
def made_cover(robot: Robot, meshes: bool = True, tries: int = 1) -> Cover:
    """Makes the cover of a robot from its URDF and its solids.

    A pair is left out in three cases: the plant leaves it out, its capsules are nearer than 10 mm at home, or
    its capsules touch in many postures in which its solids do not touch.

    Args:
        robot: a robot that has its collision geometry.
        meshes: whether mesh files are read.
        tries: with 2, a second cover is tried. It has more capsules on bodies whose capsules touch while
            their solids do not. The cover that leaves out fewer pairs is returned.
    """
    surfaces = list(patches(robot, meshes))
    supports = robot.model.supports
    longest = max(max(map(len, supports)) - 1, 1)
    weights = {k: 1.0 - _TAPER * (1.0 - (len(own) - 1) / longest) for k, own in enumerate(supports)}
    best = checked(robot, covering(surfaces, weights))
    for _ in range(tries - 1):
        close = {each for pair in own_pairs(robot, best) for each in (pair.first, pair.second)}
        if not close:
            break
        weights = {joint: weight * (_CLOSE if joint in close else 1.0) for joint, weight in weights.items()}
        now = checked(robot, covering(surfaces, weights))
        best = min(best, now, key=lambda each: len(each.excluded))
    return best


def own_pairs(robot: Robot, cover: Cover) -> tuple[Excluded, ...]:
    """Returns the pairs that a cover leaves out and the plant does not."""
    known = {(pair.first, pair.second) for pair in robot.collision.excluded}
    return tuple(pair for pair in cover.excluded if (pair.first, pair.second) not in known)


def near(robot: Robot, q: np.ndarray, distance: float) -> set[Bodies]:
    """Returns the pairs of bodies whose capsules are nearer than a distance, m, at q (n,), rad, except the
    pairs that the cover leaves out."""
    if robot.cover is None or not robot.cover.capsules:
        return set()
    solids = tuple(map(as_solid, robot.cover.capsules))
    return touching(replace(robot, collision=CollisionModel(solids, robot.cover.excluded)), q, distance)


def checked(robot: Robot, capsules: tuple[Capsule, ...]) -> Cover:
    """Returns the cover with these capsules and the pairs to leave out."""
    solids = tuple(map(as_solid, capsules))
    found = Cover(capsules, collision_model(robot, solids, near_home=NEAR).excluded)
    excluded = (*robot.collision.excluded, *own_pairs(robot, found))
    covered = replace(robot, collision=CollisionModel(solids, excluded))
    return Cover(capsules, (*excluded, *_useless(robot, covered)))


def _useless(robot: Robot, covered: Robot) -> list[Excluded]:
    counts: Counter[tuple[int, int]] = Counter()
    both: Counter[tuple[int, int]] = Counter()
    postures = list(zip(touching_often(robot), touching_often(covered), strict=True))
    for real, found in postures:
        counts.update(found - real)
        both.update(found & real)
    names = {solid.joint: solid.link for solid in reversed(covered.collision.solids)}
    return [
        Excluded(a, b, (names[a], names[b]), "cover")
        for (a, b), count in sorted(counts.items())
        if count > USELESS * (len(postures) - both[a, b])
    ]


def as_solid(capsule: Capsule) -> Solid:
    """Returns a capsule of a cover as a solid of the plant."""
    start, end = np.array(capsule.start), np.array(capsule.end)
    length = float(np.linalg.norm(end - start))
    middle = point(0.5 * (start + end))
    if length < 1e-6:
        size: tuple[float, ...] = (capsule.radius,)
        return Solid(capsule.joint, capsule.link, "sphere", "capsule", size, middle)
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), (end - start) / length)
    i, j, k, w = (float(value) for value in turn.coeffs())
    size = capsule.radius, 0.5 * length
    return Solid(capsule.joint, capsule.link, "capsule", "capsule", size, middle, (w, i, j, k))
