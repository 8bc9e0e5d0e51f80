"""The base class of orientation tasks: the orientation error on one, two or three axes."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from himpc.references.preview import Preview
from himpc.rotation import exp3, log3
from himpc.tasks.axes import AXES, OnAxes
from himpc.tasks.seen import NUDGE, at_rest, rests, seen
from himpc.tasks.task import Gain
from robots.arrays import Array

if TYPE_CHECKING:
    from himpc.kinematics.configuration import Configuration

_UPRIGHT = 1e-12
"""Sine of an angle. A direction within this angle counts as equal to the desired direction, or to its
opposite."""


@dataclass(frozen=True, kw_only=True)
class OrientationTask(OnAxes):
    """The value is a rotation matrix R (3, 3), x̃ in rad along the chosen axes; with E = R R_dᵀ:

    - three axes: x̃ = log₃ E, ẋ = ω;
    - two axes: E moves the free axis f, which is fixed to the frame, to E f. x̃ = φ (f × E f)/‖f × E f‖ is
      the rotation from f to E f, and ẋ = ω on the two axes (reduced attitude: a rotation about f by any angle
      is no error);
    - one axis a: x̃ = aᵀ log₃ E, ẋ = aᵀ J_l⁻¹(log₃ E) ω with the inverse of SO(3)'s left Jacobian.

    On one axis, ẋ is the derivative of x̃. On two or three axes, the component of ẋ along x̃ is exactly the
    derivative of x̃, and the other components are to first order in x̃. Stability needs the component along
    x̃ only: d/dt ½‖x̃‖² = x̃ᵀ(ẋ − ẋ_d), so that (4) decreases ½‖ẋ − ẋ_d‖² + ½ K_p‖x̃‖² at the rate K_v‖ẋ −
    ẋ_d‖² at every angle below 180°. (Single components of log₃ E, with ẋ = ω on the same axes, do not have
    this property: if the free rotation is θ, the characteristic polynomial is s² + K_v s + K_p (θ/2)(cot θ/2
    ± i), which is unstable where K_v² cot θ/2 < K_p θ/2.)
    """

    K_p: Gain = 50.0
    K_v: Gain = 5.0

    @abstractmethod
    def rotations(self, configuration: Configuration) -> list[Array]:
        """Returns R at every knot: N matrices (3, 3)."""

    @abstractmethod
    def angular_jacobian(self, configuration: Configuration) -> Array:
        """Returns the Jacobian of ω at every knot, (N, 3, n)."""

    def error(self, value: Array, desired: Array) -> Array:
        return rotation_error(value @ desired.T, self.axes)

    def jacobian(self, configuration: Configuration) -> Array:
        rows, preview = self.angular_jacobian(configuration), configuration.previews.get(self.name)
        if len(self.axes) > 1 or preview is None:
            return rows[:, self.components]
        return self.slopes(self.rotations(configuration), [preview.value] * len(rows)) @ rows

    def slopes(self, rotations: list[Array], desired: list[Array]) -> Array:
        """Returns ∂ẋ/∂ω, (N, m, 3), for R and R_d at every knot."""
        return np.array([slope(R @ R_d.T, self.axes) for R, R_d in zip(rotations, desired, strict=True)])

    def reference_in_task_coordinates(self, configuration: Configuration, preview: Preview) -> Preview:
        """Returns the desired motion in the coordinates of x̃. On fewer than three axes, a reference that
        rotates with ω_d changes x̃ at the rate −slope(E) E ω_d. This is also true after a rotation about the
        free axis."""
        if len(self.axes) == len(AXES):
            return preview
        if rests(preview):
            return at_rest(preview, len(self.axes))
        moved, omega_d, alpha_d = (self.spread(samples) for samples in preview[1:])
        rotations = self.rotations(configuration)
        omega = self.angular_jacobian(configuration)[0] @ configuration.v
        G, change = np.zeros((2, len(moved), len(self.axes), 3))
        for j, turned in enumerate(moved):
            E = rotations[min(j, len(rotations) - 1)] @ (exp3(turned) @ preview.value).T
            on, off = exp3(NUDGE * omega), exp3(NUDGE * omega_d[j])
            G[j] = self._taken(E)
            change[j] = (self._taken(on @ E @ off.T) - self._taken(on.T @ E @ off)) / (2 * NUDGE)
        return seen(preview, (moved, omega_d, alpha_d), G, change)

    def _taken(self, E: Array) -> Array:
        return slope(E, self.axes) @ E

    def spread(self, motion: Array) -> Array:
        """Returns a motion with components along all three axes, (N+1, 3). The given motion may contain the
        chosen axes only."""
        if motion.shape[1] == len(AXES):
            return motion
        full = np.zeros((len(motion), len(AXES)))
        full[:, self.components] = motion
        return full


def rotation_error(E: Array, axes: str) -> Array:
    """Returns x̃ of E = R R_dᵀ on some axes, (m,) rad; see `OrientationTask`."""
    if len(axes) != 2:
        error = log3(E)
        return error if axes == AXES else error[[AXES.index(axis) for axis in axes]]
    free = next(index for index, axis in enumerate(AXES) if axis not in axes)
    first, second = (free + 1) % 3, (free + 2) % 3
    aside, ahead = math.hypot(E[first, free], E[second, free]), E[free, free]
    error = np.zeros(3)
    if aside > _UPRIGHT:
        share = math.atan2(aside, ahead) / aside
        error[first], error[second] = -share * E[second, free], share * E[first, free]
    elif ahead > 0.0:
        error[first], error[second] = -E[second, free], E[first, free]
    else:
        error[first] = math.pi
    return error[[AXES.index(axis) for axis in axes]]


def slope(E: Array, axes: str) -> Array:
    """Returns ∂ẋ/∂ω, (m, 3); see `OrientationTask`."""
    rows = np.eye(3)[[AXES.index(axis) for axis in axes]]
    return rows @ left_inverse(log3(E)) if len(axes) == 1 else rows


def left_inverse(w: Array) -> Array:
    """Returns J_l⁻¹(w) of SO(3), (3, 3): d/dt log₃ E = J_l⁻¹(log₃ E) ω for Ė = [ω]× E, ‖w‖ ≤ π."""
    angle = math.sqrt(float(w @ w))
    even = 0.5 * angle / math.tan(0.5 * angle) if angle > 1e-4 else 1.0 - angle * angle / 12.0
    bent = (1.0 - even) / (angle * angle) if angle > 1e-4 else 1.0 / 12.0
    x, y, z = w
    across = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    return even * np.eye(3) + bent * np.outer(w, w) - 0.5 * across
