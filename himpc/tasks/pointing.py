"""A task that points an axis of a frame at a point, for example the axis of a camera or a torch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from himpc.references.preview import Preview
from himpc.rotation import exp3
from himpc.tasks.axes import AXES
from himpc.tasks.seen import NUDGE, at_rest, rests, seen
from himpc.tasks.task import Gain, Task
from robots.arrays import Array
from robots.errors import unknown_name

if TYPE_CHECKING:
    from himpc.kinematics.configuration import Configuration
    from robots import Robot

DIRECTIONS = ("x", "y", "z", "-x", "-y", "-z")
AHEAD = 0.5
"""Distance from the frame's origin, along the axis, at which a target starts, m."""
_NEAREST = 0.02
"""A point that is nearer than this, m, is treated as if it had this distance. Otherwise the direction to the
point could change arbitrarily fast."""
_ASIDE = 1e-2
"""If the sine of the angle to the opposite direction is below this value (0.6°), ‖J‖ is constant."""
_STRAIGHT = 1e-9
"""If the sine of the angle is below this value, the axis counts as pointing at the point."""


@dataclass(frozen=True, kw_only=True)
class Pointing(Task):
    """x = φ ŝ⊥, rad: the angle φ between the axis a of the frame and the direction to a point c, and its
    side.

    s = Rᵀ(c − p) is the point in the frame's coordinates, and ŝ⊥ is the direction of its component
    perpendicular to a. x̃ = x, because the coordinates are relative to the target: x_d is the point c, (3,) m
    in the world. φ = π is singular: at exactly this angle, ŝ⊥ is the first of the two axes perpendicular to
    a.

    Attributes:
        frame: name of a frame of the robot; empty means the robot's tip.
        axis: axis of the frame, one of x, y, z, -x, -y, -z.
    """

    frame: str = ""
    axis: str = "z"
    K_p: Gain = 50.0
    K_v: Gain = 5.0

    unit: ClassVar[Literal["m", "rad"]] = "rad"

    def __post_init__(self) -> None:
        """Raises InputError for an unknown axis."""
        if self.axis not in DIRECTIONS:
            raise unknown_name(f"axis of task '{self.name}'", self.axis, DIRECTIONS)

    def coordinates(self, robot: Robot) -> tuple[str, ...]:
        return tuple(AXES[axis] for axis in self._across)

    @property
    def _along(self) -> int:
        return AXES.index(self.axis[-1])

    @property
    def _across(self) -> list[int]:
        return [(self._along + 1) % 3, (self._along + 2) % 3]

    def _direction(self) -> Array:
        axis = np.zeros(3)
        axis[self._along] = -1.0 if self.axis[0] == "-" else 1.0
        return axis

    def target(self, configuration: Configuration) -> Array:
        return configuration.placement(self.frame).act(AHEAD * self._direction())

    def _point(self, configuration: Configuration) -> Array:
        preview = configuration.previews.get(self.name)
        return self.target(configuration) if preview is None else preview.value

    def _seen(self, point: Array) -> tuple[Array, Array]:
        """Returns x (2,) and ∂x/∂s (2, 3) for a point s in the frame's coordinates, (3,) m."""
        distance = float(np.linalg.norm(point))
        if distance < _NEAREST:
            point = point * (_NEAREST / distance) if distance > 0.0 else _NEAREST * self._direction()
            distance = _NEAREST
        across, ahead = point[self._across], float(point @ self._direction())
        aside = float(np.linalg.norm(across))
        angle = np.arctan2(aside, ahead)
        side = across / aside if aside > 0.0 else np.array([1.0, 0.0])
        straight = ahead > 0.0 and aside <= _STRAIGHT * distance
        x = across / distance if straight else angle * side
        ratio = 1.0 / distance if straight else angle / max(aside, _ASIDE * distance if ahead < 0.0 else 0.0)
        slope = np.zeros((2, 3))
        slope[:, self._across] = ratio * np.eye(2)
        slope[:, self._across] += (ahead / distance**2 - ratio) * np.outer(side, side)
        slope -= np.outer(across / distance**2, self._direction())
        return x, slope

    def value(self, configuration: Configuration) -> Array:
        placement = configuration.placement(self.frame)
        return self._seen(placement.actInv(self._point(configuration)))[0]

    def error(self, value: Array, desired: Array) -> Array:
        return value

    def jacobian(self, configuration: Configuration) -> Array:
        point, rows = self._point(configuration), configuration.frame_jacobians(self.frame)
        jacobian = np.empty((len(rows), 2, rows.shape[2]))
        for j, placement in enumerate(configuration.placements(self.frame)):
            s, turn = placement.actInv(point), placement.rotation.T
            # ṡ = −Rᵀṗ − Rᵀω × s
            moved = np.cross(s, turn @ rows[j, 3:], axisb=0).T - turn @ rows[j, :3]
            jacobian[j] = self._seen(s)[1] @ moved
        return jacobian

    def reference_in_task_coordinates(self, configuration: Configuration, preview: Preview) -> Preview:
        """Returns the reference that compensates the motion of the point: a velocity ċ of the point changes x
        at the rate ∂x/∂c ċ."""
        if rests(preview):
            return at_rest(preview, 2)
        moved, c_dot, _ = preview[1:]
        rows, placements = configuration.frame_jacobians(self.frame)[0], configuration.placements(self.frame)
        p_dot, omega = rows[:3] @ configuration.v, rows[3:] @ configuration.v
        on = exp3(NUDGE * omega)
        G, change = np.zeros((2, len(moved), 2, 3))
        for j, gone in enumerate(moved):
            placement = placements[min(j, len(placements) - 1)]
            R, away, step = (
                placement.rotation,
                preview.value + gone - placement.translation,
                NUDGE * (c_dot[j] - p_dot),
            )
            G[j] = self._back(R, away)
            change[j] = (self._back(on @ R, away + step) - self._back(on.T @ R, away - step)) / (2 * NUDGE)
        return seen(preview, (moved, c_dot, preview.acceleration), G, change)

    def _back(self, R: Array, away: Array) -> Array:
        """Returns −∂x/∂c, (2, 3), for a frame with orientation R. `away` is the vector from the frame's
        origin to the point, in world axes."""
        return self._seen(R.T @ away)[1] @ -R.T
