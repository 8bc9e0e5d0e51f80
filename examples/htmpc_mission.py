"""A mission of your own under HTMPC: the hand visits two points, the base visits one; two tasks at a time.

The task manager gives the controller a window of the next two tasks: the first task has priority, the
second task uses the remaining freedom. Prints a line per completed task with its time, and at the end the
positions of hand and base.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from himpc import HTMPC, FramePosition, HTMPCSettings, Level
from himpc.kinematics.configuration import Configuration
from himpc.missions import Go, MissionTask, Progress, advanced, where
from himpc.references import previews
from robots import VelocityPlant, load_robot

ROLES = {"hand": FramePosition(name="hand"), "base": FramePosition(name="base", frame="base", axes="xy")}
MISSION = (
    MissionTask("pick", "hand", Go((0.9, 0.6, 0.9)), tolerance=0.02, hold=0.5),
    MissionTask("drive", "base", Go((1.5, -0.5)), tolerance=0.05),
    MissionTask("place", "hand", Go((2.2, -0.8, 0.8)), tolerance=0.02, hold=0.5),
)


def main(seconds: float = 20.0) -> None:
    """Prints the results that the module describes."""
    robot = load_robot("ridgeback-ur10")
    plant = VelocityPlant(robot)
    progress = Progress(MISSION)
    settings = HTMPCSettings(tuple(Level((task,), Q=100.0) for task in ROLES.values()))
    controller = HTMPC(robot, settings)
    data, done = robot.model.createData(), 0
    while plant.t < seconds and not progress.done:
        state = plant.measure()
        points, speeds = where(Configuration(robot, data, state.q, state.v), ROLES)
        progress = advanced(progress, 2, plant.t, points, speeds)
        for name, t in progress.completed[done:]:
            print(f"completed: {name} at {t:.1f} s")
        done = len(progress.completed)
        # The window becomes the stack: its first task is level 1. The controller keeps its present plan.
        window = {active.task.role: active.reference for active in progress.window}
        stack = tuple(Level((ROLES[role],), Q=100.0) for role in window)
        controller.configure(replace(settings, stack=stack))
        plan = controller.step(state.q, state.v, previews(window, plant.t, settings.dt, settings.horizon))
        for k in range(1, 11):
            plant.step(plan.motion.velocity(0.01 * k), 0.01)
    points, _ = where(Configuration(robot, data, plant.q, plant.v), ROLES)
    for role, point in points.items():
        print(f"{role}: at {np.round(point, 3)} m after {plant.t:.1f} s")


if __name__ == "__main__":
    main()
