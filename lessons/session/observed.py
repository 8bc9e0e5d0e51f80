"""The objects around the robot as the simulation reports them to a controller: at their true places."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from himpc.limits.avoidance import Avoidance
from himpc.references.observed import NOTHING, Observed
from robots import Plant
from robots.collision import Ball, Box, Floor
from robots.world import Post, Thing


def observed(plant: Plant, avoidance: Avoidance) -> Observed:
    """Returns the objects of a plant's world at their present places, if distances are kept."""
    return objects_of(plant) if avoidance.on else NOTHING


def objects_of(plant: Plant) -> Observed:
    """Returns the objects of a plant's world at their present places. A free box or post counts as
    upright."""
    shapes, moving = [thing.shape for thing in plant.world], plant.object_velocities()
    if not len(moving):
        return Observed(tuple(shapes))
    poses, velocities = iter(plant.objects()), iter(moving)
    velocity = np.zeros((len(plant.world), 3))
    for index, thing in enumerate(plant.world):
        if thing.free:
            shapes[index], velocity[index] = _moved(thing, next(poses)), next(velocities)
    return Observed(tuple(shapes), velocity)


def _moved(thing: Thing, pose: np.ndarray) -> Ball | Box | Post | Floor:
    x, y, z, w, _, _, k = pose.tolist()
    match thing.shape:
        case Ball() as ball:
            return replace(ball, centre=(x, y, z))
        case Box() as box:
            return replace(box, centre=(x, y, z), yaw=2.0 * float(np.arctan2(k, w)))
        case Post() as post:
            return replace(post, foot=(x, y, z - 0.5 * post.height))
        case Floor() as floor:
            return floor
