"""The horizontal reach of an arm."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from robots.robot import Robot

_STARTS = 8


def horizontal_reach(robot: Robot, first: int) -> float:
    """Returns the largest horizontal distance of the tip from the base's vertical axis, m, within the joints'
    ranges.

    Args:
        robot: the robot.
        first: index of the arm's first joint; the joints before it belong to the base. 0: the robot has no
            base, and the axis is the axis of the first joint.
    """
    from scipy.optimize import minimize  # its import takes long, and few programs need it

    model, data, tip = robot.model, robot.model.createData(), robot.frame_id(robot.tip)

    def nearness(arm: np.ndarray) -> float:
        q = np.concatenate([robot.home[:first], arm])
        pin.framesForwardKinematics(model, data, q)
        away = data.oMf[tip].translation - data.oMi[max(first, 1)].translation
        return -float(np.hypot(away[0], away[1]))

    lower = np.where(np.isfinite(robot.q_lower), robot.q_lower, -np.pi)[first:]
    upper = np.where(np.isfinite(robot.q_upper), robot.q_upper, np.pi)[first:]
    middle = np.random.default_rng(0).uniform(lower, upper, (_STARTS - 1, len(lower)))
    found = [
        minimize(nearness, start, method="L-BFGS-B", bounds=list(zip(lower, upper, strict=True))).fun
        for start in (robot.home[first:], *middle)
    ]
    return -float(min(found))
