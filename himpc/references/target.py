"""A dragged target. It is filtered so that x_d, ẋ_d and ẍ_d are consistent and stay within caps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from himpc.references.preview import Preview
from robots.arrays import Array


@dataclass(frozen=True)
class Caps:
    """Largest speed (m/s or rad/s), acceleration (…/s²) and jerk (…/s³) of the filtered target."""

    speed: float = 0.5
    acceleration: float = 2.0
    jerk: float = 40.0


POSITION_CAPS = Caps()
ROTATION_CAPS = Caps(speed=1.2, acceleration=6.0, jerk=120.0)
JOINT_CAPS = Caps(speed=1.0, acceleration=5.0, jerk=100.0)

_ROOM = 200
"""Number of periods after which the remaining samples are moved to the front of a new array."""


Roll = Callable[[Array, int, Array, Array, float, Array], None]
"""A function with the arguments of `himpc.tick.kernel.target.roll`."""


class Target:
    """The filtered target and its preview.

    The filter computes one step per control period. The acceleration a is constant in each step, so x_d
    changes by exactly T_s ẋ_d + T_s² a/2 and ẋ_d by exactly T_s a. The preview contains future states of the
    same filter for a constant raw target. These states are stored. If the raw target does not change, they
    become the reference of the next ticks.

    Attributes:
        raw: the raw target, before the filter: (m,) coordinates, or a rotation matrix (3, 3).
        caps: caps on speed, acceleration and jerk of the filtered motion.
    """

    def __init__(self, value: Array, caps: Caps, roll: Roll) -> None:
        """The target starts at rest at `value`. `roll` computes the filter. A target with the lab's filter,
        which is compiled, is `himpc.controllers.dragged_target(value, caps)`."""
        value = np.array(value, float)
        self.raw = value
        self.caps = caps
        self._rotation = value.ndim == 2
        self._filter = roll
        self._m = 3 if self._rotation else value.size
        self._caps = np.array([caps.speed, caps.acceleration, caps.jerk, *np.zeros(3 * self._m)])
        # See `himpc.tick.kernel.target.roll`; the first `_known` samples are computed, and sample 0 is the
        # present one.
        self._samples = np.zeros((2, value.size + 3 * self._m + 1))
        self._samples[0, : value.size], self._samples[0, -1], self._known = value.ravel(), 1.0, 1
        self._time: float | None = None
        self._period, self._rests = 0.0, True
        self._rest: tuple[int, Preview] | None = None

    @property
    def value(self) -> Array:
        """x_d now."""
        return self._samples[0, : self.raw.size].reshape(self.raw.shape).copy()

    def move(self, raw: Array) -> None:
        """Moves the raw target. The filtered motion continues smoothly from its present state."""
        self.raw = np.array(raw, float)
        self._samples[0, -1], self._rests = 0.0, False
        self._forget_future()

    def jump(self, value: Array) -> None:
        """Sets the raw and the filtered target to `value`, at rest (for resets)."""
        self.__init__(value, self.caps, self._filter)

    def _forget_future(self) -> None:
        self._known, self._rest = 1, None

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        """Returns the filtered motion at t … t + N·T_s; each later t advances the filter by one period."""
        if self._rests_at(t, T_s):
            if self._rest is None or self._rest[0] != N:
                self._rest = N, self._gathered(np.zeros((3, N + 1, self._m)))
            return self._rest[1]
        motion = np.empty((3, N + 1, self._m))
        self._roll(motion)
        return self._gathered(motion)

    def stays(self, t: float, seen: object) -> bool:
        """Returns whether the target is at rest and its preview at t equals the previous preview `seen`."""
        if self._rest is None or self._rest[1] is not seen:
            return False
        self._time = t
        return True

    def show(self, t: float, T_s: float, motion: Array) -> Array | None:
        """Writes the preview into an array, without creating objects, for callers at every period.

        Args:
            t, T_s: present time and control period, s.
            motion: output array for displacement, velocity and acceleration, (3, N+1, m).

        Returns:
            the numbers of x_d, row by row. If the target rests, or is a rotation for a task on fewer than
            three axes, nothing is written and the result is None.
        """
        if motion.shape[2] != self._m or self._rests_at(t, T_s):
            return None
        self._roll(motion)
        return self._samples[0, : self.raw.size]

    def _rests_at(self, t: float, T_s: float) -> bool:
        if T_s != self._period:
            self._period = T_s
            self._forget_future()
        later, self._time = self._time is not None and t > self._time, t
        if later and not self._rests:
            if self._known == 1:
                self._roll(np.empty((3, 2, self._m)))
            self._samples = self._samples[1:]
            self._known -= 1
            self._rests = bool(self._samples[0, -1] > 0.0)
        return self._rests

    def _roll(self, motion: Array) -> None:
        """Writes displacement, velocity and acceleration at knots 0 … N to `motion`, (3, N+1, m)."""
        count = motion.shape[1]
        if len(self._samples) < count + 1:
            samples = np.zeros((count + 1 + _ROOM, self._samples.shape[1]))
            samples[: self._known] = self._samples[: self._known]
            self._samples = samples
        self._filter(self._samples, self._known, self.raw.ravel(), self._caps, self._period, motion)
        self._known = max(self._known, count)

    def _gathered(self, motion: Array) -> Preview:
        return Preview(self.value, motion[0], motion[1], motion[2])
