"""Obstacles: HTMPC drives a mobile manipulator up to a post and under a ball.

The task of level 1 keeps the hand in its initial position. The task of level 2 moves the base towards a post,
which it must not touch. Prints the smallest distance to an obstacle along the path, the largest distance of
the hand from its initial position, and the final position of the base.
"""

from __future__ import annotations

import numpy as np

from himpc import HTMPC, FramePosition, HTMPCSettings, Level
from himpc.kinematics.configuration import Configuration
from himpc.missions import where
from himpc.references import Hold, previews
from robots import Ball, Box, VelocityPlant, load_robot

POST = Box("post", centre=(-0.75, -0.75, 0.5), size=(0.2, 0.2, 1.0))
BALL = Ball("ball", centre=(0.6, 0.0, 1.6), radius=0.15)
STACK = (
    Level((FramePosition(name="hand"),), Q=100.0),
    Level((FramePosition(name="base", frame="base", axes="xy"),), Q=100.0),
)


def main(seconds: float = 8.0) -> None:
    """Prints the results that the module describes."""
    robot = load_robot("ridgeback-ur10")
    plant = VelocityPlant(robot)
    settings = HTMPCSettings(STACK, obstacles=(POST, BALL), margin_m=0.05)
    controller = HTMPC(robot, settings)

    hand = _points(plant)["hand"]
    references = {"hand": Hold(hand), "base": Hold(np.array([-0.2, -1.2]))}

    nearest, farthest = np.inf, 0.0
    while plant.t < seconds:
        state = plant.measure()
        ahead = previews(references, plant.t, settings.dt, settings.horizon)
        plan = controller.step(state.q, state.v, ahead)
        for k in range(1, 11):
            plant.step(plan.motion.velocity(0.01 * k), 0.01)
        nearest = min(nearest, plan.clearance)
        farthest = max(farthest, float(np.linalg.norm(_points(plant)["hand"] - hand)))
    print(f"nearest: {nearest:.3f} m to an obstacle (required: {settings.margin_m} m)")
    print(f"hand: at most {1e3 * farthest:.1f} mm from its initial position")
    print(f"base: at {np.round(_points(plant)['base'], 3)} m after {plant.t:.1f} s")


def _points(plant: VelocityPlant) -> dict[str, np.ndarray]:
    at = Configuration(plant.robot, plant.robot.model.createData(), plant.q, plant.v)
    return where(at, {task.name: task for level in STACK for task in level.tasks})[0]


if __name__ == "__main__":
    main()
