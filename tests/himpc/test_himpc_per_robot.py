"""Results that are computed once for each robot are deleted together with it, because a server loads a robot
for every page."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from himpc.htmpc.kinematics import frame_at, placed
from himpc.htmpc.safety import plausible
from himpc.htmpc.settings import base_joints
from himpc.kinematics.configuration import Configuration, joint_indices
from himpc.kinematics.geometry import geometry
from robots import Robot, load_robot
from robots.per_robot import per_robot

USES: tuple[Callable[[Robot], Any], ...] = (
    base_joints,
    geometry,
    lambda robot: joint_indices(robot, robot.joint_names[:2]),
    lambda robot: Configuration(robot, robot.model.createData(), robot.home, robot.home).joint_jacobians(()),
    lambda robot: plausible(robot, robot.home, np.zeros(robot.n)),
    lambda robot: frame_at(robot, placed(geometry(robot), robot.home[None]), robot.tip),
)


@pytest.mark.parametrize("use", USES)
def test_a_robot_is_forgotten(use: Callable[[Robot], Any]) -> None:
    """No function keeps a robot in memory to which nothing else refers."""
    robot = replace(load_robot("planar3"))
    gone = weakref.ref(robot)
    use(robot)
    del robot
    gc.collect()
    assert gone() is None


def test_a_result_is_computed_once_for_each_robot() -> None:
    """The same robot and arguments give the same result object; a different robot has its own results."""
    calls = []

    @per_robot
    def joints(robot: Robot, first: int, last: int = 2) -> tuple[str, ...]:
        calls.append((robot.name, first, last))
        return robot.joint_names[first:last]

    one, other = load_robot("planar3"), load_robot("panda")
    assert joints(one, 0) is joints(one, 0)
    assert joints(one, 0, last=3) == one.joint_names[:3]
    assert joints(other, 0) == other.joint_names[:2]
    assert calls == [("planar3", 0, 2), ("planar3", 0, 3), ("panda", 0, 2)]
