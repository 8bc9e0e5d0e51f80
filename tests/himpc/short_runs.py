"""Short runs of controllers along a given motion. As a program, it writes the results of the named runs to a
file.

python short_runs.py FILE.npz NAME …
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from himpc import FramePosition, Joints, Level, Settings
from himpc.controllers.controller import Controller
from himpc.references import Circle, Hold, Phase, Reference, previews
from robots import Robot, load_robot

Array = NDArray[np.float64]


def motion(robot: Robot, t: float) -> tuple[Array, Array]:
    """Returns a state of the motion near home: q and q̇, (n,)."""
    rate, phase = 3.0, np.arange(robot.n)
    return robot.home + 0.05 * np.sin(rate * t + phase), 0.05 * rate * np.cos(rate * t + phase)


def planar() -> tuple[Robot, Settings, dict[str, Reference]]:
    """Returns a problem for the planar arm: on the first level the hand follows a circle, and the first joint
    has the second priority."""
    robot = load_robot("planar3")
    hand = FramePosition(name="hand", axes="xy")
    stack = (Level((hand,)), Level((Joints(name="q1", joints=robot.joint_names[:1]),)))
    circle = Circle(np.array([0.8, 0.4]), np.array([0.1, 0.0]), np.array([0.0, 0.1]), Phase(2.0))
    settings = Settings(stack, tuple(robot.M_bar), horizon=3)
    return robot, settings, {"hand": circle, "q1": Hold(robot.home[:1])}


def osf() -> Array:
    """Returns the torques of OSF, (ticks, n)."""
    from himpc.controllers.osf import OSF

    robot, settings, references = planar()
    controller = OSF(robot, settings)
    return torques(controller, robot, settings, references, 20)


def himpc() -> Array:
    """Returns the torques of HIMPC, (ticks, n)."""
    from himpc.controllers.himpc import HIMPC

    robot, settings, references = planar()
    return torques(HIMPC(robot, settings), robot, settings, references, 6)


def torques(
    controller: Controller, robot: Robot, settings: Settings, references: Mapping[str, Reference], ticks: int
) -> Array:
    """Returns a controller's torques along the motion."""
    controller.reset(np.zeros(robot.n))
    found = []
    for tick in range(ticks):
        t = tick * settings.T_s
        ahead = previews(references, t, settings.T_s, settings.horizon)
        found.append(controller.step(*motion(robot, t), ahead).tau)
    return np.array(found)


def htmpc() -> Array:
    """Returns the velocities of HTMPC, (ticks, n)."""
    from himpc.htmpc import HTMPC, HTMPCSettings

    robot = load_robot("iiwa14")
    stack = (
        Level((FramePosition(name="hand"),), Q=10.0),
        Level((Joints(name="q1", joints=robot.joint_names[:1]),)),
    )
    settings = HTMPCSettings(stack, horizon=4)
    controller = HTMPC(robot, settings)
    references = {"hand": Hold(np.array([0.5, 0.3, 0.5])), "q1": Hold(robot.home[:1])}
    found = []
    for tick in range(4):
        t = tick * settings.period
        plan = controller.step(*motion(robot, t), previews(references, t, settings.dt, settings.horizon))
        found.append(plan.motion.velocity(settings.period))
    return np.array(found)


RUNS: Mapping[str, Callable[[], Array]] = {"osf": osf, "himpc": himpc, "htmpc": htmpc}

if __name__ == "__main__":
    found: dict[str, Any] = {name: RUNS[name]() for name in sys.argv[2:]}
    np.savez(Path(sys.argv[1]), **found)
