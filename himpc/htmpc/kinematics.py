"""The task model of section IV-A: the tasks' errors (6) along a prediction."""

from __future__ import annotations

from functools import cached_property, partial

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from himpc.htmpc.geometry import Frames, Placed, frame_at, geometry, placed
from himpc.kinematics.configuration import Configuration
from himpc.references import Preview
from himpc.rotation import exp3
from himpc.tasks import FramePosition, OrientationTask, Task
from robots import InputError, Robot

Array = NDArray[np.float64]
Desired = list[Array] | Array
"""The references r of (6), one for each knot."""


class Knots:
    """Frames and Jacobians at all knots of a prediction, knot 1 first."""

    def __init__(self, robot: Robot, data: pin.Data, q: Array) -> None:
        """q: (K, n) configurations; data: Pinocchio's work space, for tasks that need more than frames."""
        self._robot, self._data, self._q = robot, data, q
        self._frames: dict[str, Frames] = {}

    @cached_property
    def joints(self) -> Placed:
        """The placements of all joints."""
        return placed(geometry(self._robot), self._q)

    def errors(self, task: Task, desired: Desired) -> Array:
        """Returns e = x − r of (6) at every knot, (K, m)."""
        if isinstance(task, FramePosition):
            return self._frame(task.frame).p[:, task.components] - np.asarray(desired)
        pairs = zip(self._knots, desired, strict=True)
        return np.array([task.error(task.value(knot), goal) for knot, goal in pairs])

    def value(self, task: Task) -> Array:
        """Returns x at the first knot."""
        if isinstance(task, FramePosition):
            return self._frame(task.frame).p[0, task.components]
        return task.value(self._knots[0])

    def jacobian(self, task: Task, desired: Desired) -> Array:
        """Returns J of a task at every knot, (K, m, n), for the reference r = `desired`."""
        if isinstance(task, FramePosition):
            return self._frame(task.frame).J[:, :3][:, task.components]
        if isinstance(task, OrientationTask) and len(task.axes) == 1:
            rotations = [task.value(knot) for knot in self._knots]
            return task.slopes(rotations, list(desired)) @ task.angular_jacobian(self._path)
        return task.jacobian(self._path)

    def _frame(self, name: str) -> Frames:
        frames = self._frames.get(name)
        if frames is None:
            frames = self._frames[name] = frame_at(self._robot, self.joints, name)
        return frames

    @cached_property
    def _path(self) -> Configuration:
        """All knots as one `Configuration`, used for Jacobians only."""
        robot, data, q = self._robot, self._data, self._q
        return Configuration(robot, data, q[0], q[0], q[1:], jacobians=lambda frame: self._frame(frame).J)

    @cached_property
    def _knots(self) -> list[Configuration]:
        """One `Configuration` per knot, used for positions only."""
        every = enumerate(self._q)
        return [
            Configuration(self._robot, self._data, q, q, placed=partial(self._placement, k)) for k, q in every
        ]

    def _placement(self, knot: int, frame: str) -> pin.SE3:
        frames = self._frame(frame)
        return pin.SE3(frames.R[knot], frames.p[knot])


def desired_values(task: Task, preview: Preview, N: int) -> Desired:
    """Returns r of (6) at knots 0 … N.

    Raises:
        InputError: the preview does not have N + 1 samples.
    """
    if len(preview.displacement) != N + 1:
        raise InputError(
            f"the preview of task '{task.name}' has {len(preview.displacement)} samples, not {N + 1}: knots "
            f"0 to {N} are needed, as `previews(references, t, dt, {N})` returns them"
        )
    if preview.value.ndim == 1:
        return preview.value + preview.displacement
    turn = task.spread(preview.displacement) if isinstance(task, OrientationTask) else preview.displacement
    return [exp3(vector) @ preview.value for vector in turn]
