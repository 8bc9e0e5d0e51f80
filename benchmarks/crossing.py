"""The path of a ball that is dragged through an arm, for `benchmarks.avoidance`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from lessons.session.torque import TorqueSession

Array = NDArray[np.float64]

BALL_M, BESIDE_M, BALL_SPEED = 0.08, 0.6, (0.15, 0.5)
"""Radius of a dragged ball, the length of its path before and behind a link, and its range of speeds, m/s."""
PAST_M, CLEAR_M = 0.25, 0.35
"""The smallest distance, m, between the ball's path and the first three joints of an arm, and between the
start of the path and the whole arm."""


class Crossing(NamedTuple):
    """A ball that is dragged through an arm: its position at the start, m, its velocity, m/s, and the
    duration, s."""

    start: Array
    velocity: Array
    seconds: float


def crossing(session: TorqueSession, rng: np.random.Generator) -> Crossing:
    """Returns a path through the origin of a random joint that moves. The path does not come near the first
    three joints of the arm."""
    robot, data = session.robot, session.robot.model.createData()
    pin.forwardKinematics(robot.model, data, session.plant.q)
    origins = np.array([each.translation for each in data.oMi])
    depth = np.array([len(each) - 1 for each in robot.model.supports])
    points = np.vstack([origins, 0.5 * (origins[1:] + origins[robot.model.parents.tolist()[1:]])])
    while True:
        away = rng.normal(size=3)
        away[2] *= 0.3
        away /= np.linalg.norm(away)
        middle, speed = origins[int(rng.choice(np.flatnonzero(depth > 3)))], rng.uniform(*BALL_SPEED)
        first = origins[depth <= 3] - middle
        along = np.clip(first @ away, -BESIDE_M, BESIDE_M)
        past = np.linalg.norm(first - along[:, None] * away, axis=1).min() > PAST_M
        if past and np.linalg.norm(points - middle - BESIDE_M * away, axis=1).min() > CLEAR_M:
            return Crossing(middle + BESIDE_M * away, -speed * away, 2.0 * BESIDE_M / speed)
