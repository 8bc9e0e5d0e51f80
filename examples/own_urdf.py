"""Your own URDF with your own stack: prints the findings of the import and moves the hand by 5 cm.

    python examples/own_urdf.py [FILE.urdf]

Level 1 moves the tip, level 2 keeps the posture. Prints the robot with its joints and its tip, a line per
finding of the import, and the distance to the goal at the start and at the end.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import lessons
from himpc import HIMPC, FramePosition, Level, Posture, Settings
from himpc.controllers import dragged_target
from himpc.references import Hold, previews
from robots import Plant, load_robot

LAMP = Path(lessons.__file__).parent / "course" / "lamp.urdf"


def main(seconds: float = 3.0, urdf: Path = LAMP) -> None:
    """Prints the results that the module describes."""
    robot = load_robot(urdf)
    print(f"robot: {robot.name}, joints {', '.join(robot.joint_names)}, tip {robot.tip}")
    for finding in robot.report.findings:
        print(f"finding: {finding}")

    plant = Plant(robot)
    _, position = plant.frame_pose(robot.tip)
    goal = position + np.array([0.0, 0.05, 0.0])
    stack = (
        Level((FramePosition(name="hand", K_p=25.0, K_v=10.0),)),
        Level((Posture(name="posture", K_p=25.0, K_v=10.0),)),
    )
    # An imported robot comes with a suggested M̄, for which the loop is stable everywhere.
    controller = HIMPC(robot, Settings(stack, tuple(robot.M_bar), horizon=5))
    controller.reset(plant.tau)
    # A target is a goal that may be moved at any time; the motion towards it stays smooth.
    hand = dragged_target(position)
    hand.move(goal)
    references = {"hand": hand, "posture": Hold(robot.home)}

    print(f"distance at the start: {1e3 * np.linalg.norm(goal - position):.2f} mm")
    while plant.t < seconds:
        state = plant.measure(1e-3)
        plan = controller.step(state.q, state.v, previews(references, plant.t, 1e-3, 5), plant.tau)
        plant.step(plan.tau, 1e-3)
    _, position = plant.frame_pose(robot.tip)
    print(f"distance at the end: {1e3 * np.linalg.norm(goal - position):.2f} mm")


if __name__ == "__main__":
    main(urdf=Path(sys.argv[1]) if len(sys.argv) > 1 else LAMP)
