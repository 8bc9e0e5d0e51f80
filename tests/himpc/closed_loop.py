"""A closed loop of a controller and the plant, written only with `himpc` and without `lessons`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from himpc import FrameOrientation, FramePosition, Level, Posture, Settings
from himpc.controllers import Controller, dragged_target, make_controller
from himpc.kinematics.configuration import Configuration
from himpc.plan import Plan
from himpc.references import JOINT_CAPS, POSITION_CAPS, ROTATION_CAPS, Outlook, Reference
from robots import NominalSettings, Plant, PlantSettings, Robot, load_robot

Array = NDArray[np.float64]

GEARED = PlantSettings(armature=(0.05, 0.05, 0.03))
"""The planar arm's M̄ is chosen for geared motors."""


class Loop:
    """A loop that starts at rest. Each tick measures, computes the previews and the torque, and applies
    it."""

    def __init__(
        self,
        controller: Controller,
        robot: Robot,
        references: dict[str, Reference],
        plant: PlantSettings | None = None,
    ) -> None:
        self.controller, self.references = controller, references
        self.plant = Plant(robot, plant)
        self.plant.reset(robot.home)
        controller.reset(self.plant.tau)

    def tick(self) -> Plan:
        settings, plant = self.controller.settings, self.plant
        state = plant.measure(settings.T_s)
        ahead = Outlook(self.references, plant.t, settings.T_s, settings.horizon)
        plan = self.controller.step(state.q, state.v, ahead, plant.tau)
        plant.step(plan.tau, settings.T_s)
        return plan


def holding(name: str, controller: str, horizon: int = 5, nominal: NominalSettings | None = None) -> Loop:
    """Returns a loop in which a robot of the catalog holds hand and posture; its targets can be moved."""
    robot = load_robot(name)
    flat = name == "planar3"
    position = FramePosition(name="position", axes="xy" if flat else "xyz", K_p=100.0, K_v=20.0)
    turns = [] if flat else [FrameOrientation(name="orientation", K_p=100.0, K_v=20.0)]
    tasks = (position, *turns, Posture(name="posture", K_p=100.0, K_v=20.0))
    at_home = Configuration(robot, robot.model.createData(), robot.home, np.zeros(robot.n))
    stack = tuple(Level((task,)) for task in tasks)
    nominal = nominal or NominalSettings()
    settings = Settings(stack, tuple(robot.M_bar), horizon=horizon, nominal=nominal)
    caps = {"position": POSITION_CAPS, "orientation": ROTATION_CAPS, "posture": JOINT_CAPS}
    targets: dict[str, Reference] = {
        task.name: dragged_target(task.target(at_home), caps[task.name]) for task in tasks
    }
    return Loop(make_controller(controller, robot, settings), robot, targets, GEARED if flat else None)
