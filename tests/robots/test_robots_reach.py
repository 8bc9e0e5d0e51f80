"""Inverse kinematics finds joint positions for reachable targets, and reports targets out of reach."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from robots import CATALOG, InputError, load_robot
from robots.reach import ReachJudge


@pytest.mark.parametrize("name", CATALOG)
def test_poses_of_the_robot_are_reachable(name: str) -> None:
    robot = load_robot(name)
    judge = ReachJudge(robot)
    data = robot.model.createData()
    rng = np.random.default_rng(5)
    for _ in range(10):
        q = np.clip(robot.home + rng.uniform(-0.4, 0.4, robot.n), robot.q_lower + 0.05, robot.q_upper - 0.05)
        pin.framesForwardKinematics(robot.model, data, q)
        pose = data.oMf[robot.frame_id(robot.tip)]
        result = judge.solve(pose.translation, pose.rotation, robot.home, robot.tip)
        assert result.reachable
        assert np.all((result.q >= robot.q_lower) & (result.q <= robot.q_upper))
        pin.framesForwardKinematics(robot.model, data, result.q)
        found = data.oMf[robot.frame_id(robot.tip)]
        assert np.linalg.norm(found.translation - pose.translation) < 2e-3


def test_a_target_out_of_reach_is_said_to_be() -> None:
    robot = load_robot("iiwa14")
    result = ReachJudge(robot).solve(np.array([3.0, 0.0, 0.5]))
    assert not result.reachable
    assert 1.0 < result.position_error < 2.5
    assert np.all(np.isfinite(result.q))


def test_the_stretched_arm_as_seed_is_no_trap() -> None:
    robot = load_robot("iiwa14")
    assert ReachJudge(robot).solve(np.array([0.5, 0.0, 0.5]), None, np.zeros(7), "flange").reachable


def test_bad_targets_are_refused() -> None:
    robot = load_robot("planar3")
    with pytest.raises(ValueError, match="position"):
        ReachJudge(robot).solve(np.array([np.nan, 0, 0]))
    with pytest.raises(InputError, match="did you mean 'ee'"):
        ReachJudge(robot).solve(np.array([0.5, 0.3, 0]), None, None, "eee")
