"""Computes whether the robot can reach a target, by inverse kinematics as bounded nonlinear least squares,
and how far an arm reaches horizontally."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from robots.arrays import Array
from robots.robot import Robot

POSITION_TOLERANCE = 2e-3  # m
ROTATION_TOLERANCE = np.radians(1.0)  # rad
_EVALUATIONS = 60
_STARTS = 4
_MARGIN = 1e-4
"""Smallest distance between the configuration that is found and the joint limits, rad or m."""


@dataclass(frozen=True)
class ReachResult:
    """The best configuration that was found.

    Attributes:
        q: (n,) rad, inside the limits.
        position_error: m.
        rotation_error: rad; 0 if the target has no rotation.
        reachable: whether the errors are within 2 mm and 1°.
    """

    q: Array
    position_error: float
    rotation_error: float
    reachable: bool


class ReachJudge:
    """Inverse kinematics of one robot."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._data = robot.model.createData()
        self._lower, self._upper = robot.q_lower + _MARGIN, robot.q_upper - _MARGIN

    def solve(
        self,
        position: Array,
        rotation: Array | None = None,
        q_seed: Array | None = None,
        frame: str = "",
    ) -> ReachResult:
        """Returns a configuration with `frame` (default: the tip) at a position (3,), m, in the world. If a
        rotation (3, 3) in the world is given, the frame also has this rotation.

        If the target is out of reach, the result is the configuration with the least sum of squares of
        position error, m, and rotation error, rad. The search starts at `q_seed` (default: home), and then at
        a few other fixed configurations. Raises InputError for an unknown frame and ValueError for a target
        that is not finite.
        """
        index = self.robot.frame_id(frame or self.robot.tip)
        target = np.asarray(position, dtype=float)
        if target.shape != (3,) or not np.all(np.isfinite(target)):
            raise ValueError("position must be three finite numbers")
        if rotation is not None and (np.shape(rotation) != (3, 3) or not np.all(np.isfinite(rotation))):
            raise ValueError("rotation must be a finite 3 × 3 matrix")
        best: ReachResult | None = None
        for start in self._starts(self.robot.home if q_seed is None else np.asarray(q_seed, dtype=float)):
            found = self._from(start, index, target, rotation)
            if best is None or _residual(found) < _residual(best):
                best = found
            if best.reachable:
                break
        assert best is not None
        return best

    def _starts(self, seed: Array) -> list[Array]:
        """Returns the configurations, inside the limits, from which the search starts."""
        rng, home = np.random.default_rng(0), self.robot.home
        spread = 0.25 * (np.minimum(self._upper, np.pi) - np.maximum(self._lower, -np.pi))
        others = [home + rng.uniform(-1, 1, self.robot.n) * spread for _ in range(_STARTS - 1)]
        return [np.clip(q, self._lower, self._upper) for q in (seed, *others)]

    def _from(self, start: Array, index: int, position: Array, rotation: Array | None) -> ReachResult:
        from scipy.optimize import least_squares  # its import takes long, and few programs need it

        model, data = self.robot.model, self._data

        def errors(q: Array) -> Array:
            pin.forwardKinematics(model, data, q)
            pose = pin.updateFramePlacement(model, data, index)
            away = pose.translation - position
            return away if rotation is None else np.r_[away, pin.log3(rotation.T @ pose.rotation)]

        def slopes(q: Array) -> Array:
            J = pin.computeFrameJacobian(model, data, q, index, pin.ReferenceFrame.LOCAL).reshape(6, -1)
            R = data.oMf[index].rotation
            if rotation is None:
                return R @ J[:3]
            return np.vstack([R @ J[:3], pin.Jlog3(rotation.T @ R) @ J[3:]])

        bounds = self._lower, self._upper
        jac: Any = slopes  # SciPy's type annotation does not allow a function
        q = least_squares(errors, start, jac, bounds, "dogbox", 1e-4, 1e-5, 1e-6, max_nfev=_EVALUATIONS).x
        left = errors(q)
        distance, angle = float(np.linalg.norm(left[:3])), float(np.linalg.norm(left[3:]))
        reachable = distance <= POSITION_TOLERANCE and angle <= ROTATION_TOLERANCE
        return ReachResult(q, distance, angle, reachable)


def _residual(result: ReachResult) -> float:
    return result.position_error / POSITION_TOLERANCE + result.rotation_error / ROTATION_TOLERANCE


_REACHES = 8  # number of configurations from which `horizontal_reach` searches


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
    middle = np.random.default_rng(0).uniform(lower, upper, (_REACHES - 1, len(lower)))
    found = [
        minimize(nearness, start, method="L-BFGS-B", bounds=list(zip(lower, upper, strict=True))).fun
        for start in (robot.home[first:], *middle)
    ]
    return -float(min(found))
