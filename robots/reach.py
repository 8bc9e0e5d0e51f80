"""Decides which targets the robot can reach, by placo's inverse kinematics. No other module imports placo."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import placo
from lxml import etree

from robots.robot import Robot
from robots.urdf.read import without_shapes

POSITION_TOLERANCE = 2e-3  # m
ROTATION_TOLERANCE = np.radians(1.0)  # rad
_ITERATIONS = 60
_RESTARTS = 4
_STEP = 0.5  # rad: the most a joint moves per iteration, so that the linearisation holds


@dataclass(frozen=True)
class ReachResult:
    """The best configuration found.

    Attributes:
        q: (n,) rad, inside the limits.
        position_error: m.
        rotation_error: rad; 0 if the target has no rotation.
        reachable: whether the errors are within 2 mm and 1°.
    """

    q: np.ndarray
    position_error: float
    rotation_error: float
    reachable: bool


class ReachJudge:
    """placo's solver for one robot. Building it takes longer than using it, so it is kept."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        text = without_shapes(etree.fromstring(robot.urdf_text.encode()))
        self._wrapper = placo.RobotWrapper("", placo.Flags.ignore_collisions, text)
        self._data = robot.model.createData()
        margin = 1e-4
        self._lower = np.where(np.isfinite(robot.q_lower), robot.q_lower + margin, -np.inf)
        self._upper = np.where(np.isfinite(robot.q_upper), robot.q_upper - margin, np.inf)

    def solve(
        self,
        position: np.ndarray,
        rotation: np.ndarray | None = None,
        q_seed: np.ndarray | None = None,
        frame: str = "",
    ) -> ReachResult:
        """Finds a configuration that brings `frame` (default: the tip) to a world position (3,), m, and, if
        given, to a world rotation (3, 3).

        Tasks are soft, so a target out of reach gives the nearest posture instead of an exception, and the
        residual decides whether it counts as reached. The search starts at `q_seed` (default: home), then at
        a few other fixed configurations. Raises InputError for an unknown frame, ValueError for a target that
        is not finite.
        """
        name = frame or self.robot.tip
        index = self.robot.frame_id(name)
        target = np.asarray(position, dtype=float)
        if target.shape != (3,) or not np.all(np.isfinite(target)):
            raise ValueError("position must be three finite numbers")
        if rotation is not None and (np.shape(rotation) != (3, 3) or not np.all(np.isfinite(rotation))):
            raise ValueError("rotation must be a finite 3 × 3 matrix")
        seed = self.robot.home if q_seed is None else np.asarray(q_seed, dtype=float)
        rng = np.random.default_rng(0)
        spread = np.minimum(self._upper, np.pi) - np.maximum(self._lower, -np.pi)
        best: ReachResult | None = None
        for attempt in range(_RESTARTS):
            start = (
                seed if attempt == 0 else self.robot.home + 0.25 * rng.uniform(-1, 1, self.robot.n) * spread
            )
            result = self._from(np.clip(start, self._lower, self._upper), name, index, target, rotation)
            if best is None or _residual(result) < _residual(best):
                best = result
            if best.reachable:
                break
        assert best is not None
        return best

    def _from(
        self, seed: np.ndarray, name: str, index: int, position: np.ndarray, rotation: np.ndarray | None
    ) -> ReachResult:
        solver = placo.KinematicsSolver(self._wrapper)
        solver.mask_fbase(True)
        solver.enable_joint_limits(True)
        solver.dt = 1.0
        solver.enable_velocity_limits(False)
        if rotation is None:
            task = solver.add_position_task(name, position)
            task.configure("position", "soft", 1.0)
        else:
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = rotation, position
            frame_task = solver.add_frame_task(name, pose)
            frame_task.configure("pose", "soft", 1.0, 1.0)
        solver.add_regularization_task(1e-6)
        q = seed
        self._place(q)
        for _ in range(_ITERATIONS):
            try:
                solver.solve(True)
            except RuntimeError:
                break
            after = np.array([self._wrapper.get_joint(joint) for joint in self.robot.joint_names])
            step = np.clip(after - q, -_STEP, _STEP)
            if not np.all(np.isfinite(step)):
                break
            q = np.clip(q + step, self._lower, self._upper)
            self._place(q)
            if float(np.abs(step).max()) < 1e-7:
                break
        return self._judge(q, index, position, rotation)

    def _place(self, q: np.ndarray) -> None:
        for joint, value in zip(self.robot.joint_names, q, strict=True):
            self._wrapper.set_joint(joint, float(value))
        self._wrapper.update_kinematics()

    def _judge(
        self, q: np.ndarray, index: int, position: np.ndarray, rotation: np.ndarray | None
    ) -> ReachResult:
        """Computes the residual with Pinocchio's kinematics, independently of the solver's own result."""
        model = self.robot.model
        pin.forwardKinematics(model, self._data, q)
        pose = pin.updateFramePlacement(model, self._data, index)
        distance = float(np.linalg.norm(pose.translation - position))
        angle = 0.0 if rotation is None else float(np.linalg.norm(pin.log3(rotation.T @ pose.rotation)))
        return ReachResult(
            q.copy(), distance, angle, distance <= POSITION_TOLERANCE and angle <= ROTATION_TOLERANCE
        )


def _residual(result: ReachResult) -> float:
    return result.position_error / POSITION_TOLERANCE + result.rotation_error / ROTATION_TOLERANCE
