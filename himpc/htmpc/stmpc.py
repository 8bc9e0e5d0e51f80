"""Relatives of HTMPC that leave something out: priorities, coordination, or foresight."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from himpc.configuration import Configuration
from himpc.htmpc.htmpc import HTMPC
from himpc.htmpc.kinematics import base_joints
from himpc.htmpc.plan import VelocityPlan
from himpc.htmpc.settings import HTMPCSettings
from himpc.references import Preview
from himpc.references.hold import still
from himpc.stack import Stack

Array = NDArray[np.float64]


class STMPC(HTMPC):
    """Single-task MPC: (9) for the first enabled level of the stack; the others are ignored."""

    def _chosen(self, enabled: Stack) -> Stack:
        return enabled[:1]


class Decoupled(STMPC):
    """The controller of the arm-base decoupled single-task architecture (section V-D).

    A task that the arm cannot move is the base's: the arm comes to rest. Any other task is the arm's: the
    base comes to rest.
    """

    def _held(self, chosen: Stack, settings: HTMPCSettings) -> NDArray[np.int64]:
        robot = self.robot
        base = np.array(base_joints(robot), np.int64)
        arm = np.setdiff1d(np.arange(robot.n), base)
        configuration = Configuration(robot, robot.model.createData(), robot.home, robot.home)
        tasks = [task for level in chosen for task in level.tasks]
        by_arm = any(np.abs(task.jacobian(configuration)[0][:, arm]).max() > 1e-9 for task in tasks)
        return np.union1d(super()._held(chosen, settings), base if by_arm else arm)


class HTMPC_WPT(HTMPC):
    """HTMPC that receives waypoints: every reference stays, in its eyes, where it is now (section V-C)."""

    def step(self, q: Array, v: Array, previews: Mapping[str, Preview]) -> VelocityPlan:
        return super().step(q, v, {name: _frozen(preview) for name, preview in previews.items()})


def _frozen(preview: Preview) -> Preview:
    knots, m = preview.displacement.shape
    rest = still(knots - 1, m)
    return Preview(preview.value, rest.displacement, rest.velocity, rest.acceleration)
