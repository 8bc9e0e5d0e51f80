"""Kinematics at one control tick: the measured state and the Jacobians along the previous prediction (30)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, final

import numpy as np
import pinocchio as pin

from robots import Robot
from robots.arrays import Array
from robots.errors import unknown_name
from robots.per_robot import per_robot

if TYPE_CHECKING:
    from himpc.references import Preview


@final
class Configuration:
    """Frames and Jacobians at the measured q_k and at the knots q*_{k+j|k−1}, j = 1 … N−1.

    Jacobians are computed once per frame and tick, for any number of tasks on that frame. Only geometry is
    used, no inertia or gravity, so the controller needs no dynamic model. The only exception is a task of the
    centre of mass, which uses masses.

    Args:
        robot: gives geometry and names.
        data: Pinocchio's work space, owned by the caller.
        q: measured joint positions, (n,) rad or m.
        v: measured joint velocities, (n,).
        knots: predicted joint positions at knots 1 … N−1, (N−1, n); empty for N = 1.
        previews: references by task name, for tasks whose coordinates depend on the position of their target.
        jacobians, placed: functions from a frame's name to its Jacobians (N, 6, n) and to its placement at
            q_k, if the caller has computed them already.
    """

    def __init__(
        self,
        robot: Robot,
        data: pin.Data,
        q: Array,
        v: Array,
        knots: Array | Sequence[Array] = (),
        previews: Mapping[str, Preview] = MappingProxyType({}),
        *,
        jacobians: Callable[[str], Array] | None = None,
        placed: Callable[[str], pin.SE3] | None = None,
    ) -> None:
        self.robot = robot
        self.q = q
        self.v = v
        self.knots = knots
        self.previews = previews
        self.horizon = len(knots) + 1
        self._data = data
        self._known, self._placed = jacobians, placed
        self._jacobians: dict[str, Array] = {}
        self._placements: dict[str, list[pin.SE3]] = {}

    def frame_jacobians(self, frame: str = "") -> Array:
        """Returns (N, 6, n) frame Jacobians, linear over angular, world axes, at the frame's origin."""
        if self._known is not None:
            return self._known(frame)
        jacobians = self._jacobians.get(frame)
        if jacobians is None:
            model, data = self.robot.model, self._data
            index = self.robot.frame_id(frame or self.robot.tip)
            compute, axes = pin.computeFrameJacobian, pin.LOCAL_WORLD_ALIGNED
            jacobians = np.empty((self.horizon, 6, self.q.size))
            # For a single joint Pinocchio returns the Jacobian as a one-dimensional array.
            columns = jacobians if self.q.size > 1 else jacobians[:, :, 0]
            placed = self._placements[frame] = []
            for j, q in enumerate((self.q, *self.knots)):
                columns[j] = compute(model, data, q, index, axes)
                placed.append(data.oMf[index].copy())
            self._jacobians[frame] = jacobians
        return jacobians

    def placement(self, frame: str = "") -> pin.SE3:
        """Returns the placement of a frame in the world at the measured state."""
        return self.placements(frame)[0] if self._placed is None else self._placed(frame)

    def placements(self, frame: str = "") -> list[pin.SE3]:
        """Returns the placements of a frame in the world at every knot; the first is the measured state's."""
        if frame not in self._placements:
            self.frame_jacobians(frame)
        return self._placements[frame]

    def relative_placement(self, frame: str, root: str) -> pin.SE3:
        """Returns the placement of a frame relative to the frame `root`, at the measured state."""
        return self.placement(root).actInv(self.placement(frame))

    def relative_jacobians(self, frame: str, root: str) -> Array:
        """Returns (N, 6, n) Jacobians of a frame relative to the frame `root`, linear over angular, axes of
        the root.

        With R of the root and d = p − p_root: Rᵀ(J_p − J_p,root + [d]× J_ω,root) and Rᵀ(J_ω − J_ω,root).
        """
        key = f"{frame}\0{root}"
        jacobians = self._jacobians.get(key)
        if jacobians is None:
            seen, sees = self.frame_jacobians(frame), self.frame_jacobians(root)
            jacobians = seen - sees
            for j, (far, near) in enumerate(zip(self.placements(frame), self.placements(root), strict=True)):
                x, y, z = far.translation - near.translation
                turn = near.rotation.T
                across = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
                jacobians[j, :3] = turn @ (jacobians[j, :3] + across @ sees[j, 3:])
                jacobians[j, 3:] = turn @ jacobians[j, 3:]
            self._jacobians[key] = jacobians
        return jacobians

    def centre_of_mass(self) -> Array:
        """Returns the centre of all moving masses at the measured state, (3,) m, world, from the robot's
        description."""
        return np.array(pin.centerOfMass(self.robot.model, self._data, self.q))

    def centre_of_mass_jacobians(self) -> Array:
        """Returns (N, 3, n) Jacobians of the centre of mass, world axes."""
        model, data, n = self.robot.model, self._data, self.q.size
        knots = (self.q, *self.knots)
        return np.array([pin.jacobianCenterOfMass(model, data, q).reshape(3, n) for q in knots])

    def joint_indices(self, joints: tuple[str, ...]) -> list[int]:
        """Returns the columns of the named joints; all of them for an empty tuple."""
        return joint_indices(self.robot, joints)

    def joint_jacobians(self, joints: tuple[str, ...]) -> Array:
        """Returns the matrices, (N, m, n), that select the named joints; they are the same at every knot."""
        return _joint_selection(self.robot, joints, self.horizon)


@per_robot
def joint_indices(robot: Robot, joints: tuple[str, ...]) -> list[int]:
    """Returns the columns of the named joints; all of them for an empty tuple.

    Raises:
        InputError: a name is not a joint of the robot.
    """
    for joint in joints:
        if joint not in robot.joint_names:
            raise unknown_name(f"joint of robot '{robot.name}' called", joint, robot.joint_names)
    return [robot.joint_names.index(joint) for joint in joints] or list(range(robot.n))


@per_robot
def _joint_selection(robot: Robot, joints: tuple[str, ...], N: int) -> Array:
    selection = np.eye(robot.n)[joint_indices(robot, joints)]
    return np.broadcast_to(selection, (N, *selection.shape))
