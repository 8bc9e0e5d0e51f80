"""A target that a hand drags: filtered so that x_d, ẋ_d and ẍ_d fit together and stay within caps."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from himpc.references.preview import Array, Preview
from himpc.rotation import exp3, log3


@dataclass(frozen=True)
class Caps:
    """Largest speed (m/s or rad/s), acceleration (…/s²) and jerk (…/s³) of the filtered target."""

    speed: float = 0.5
    acceleration: float = 2.0
    jerk: float = 40.0


POSITION_CAPS = Caps()
ROTATION_CAPS = Caps(speed=1.2, acceleration=6.0, jerk=120.0)
JOINT_CAPS = Caps(speed=1.0, acceleration=5.0, jerk=100.0)

_APPROACH = 6.0
"""1/s: how fast the remaining distance closes near the raw target."""
_RATE = 36.0
"""1/s: how fast the filtered velocity follows the one wanted."""
_STILL = 1e-9
"""Below this distance and speed the filtered target snaps to rest: it must not drift for ever."""


@dataclass(frozen=True, slots=True, eq=False)
class _Sample:
    value: Array
    velocity: Array
    acceleration: Array
    step: Array
    """How far this sample lies from the one before, (m,)."""


class Target:
    """The filtered target and its preview.

    The filter runs at the control period. Each step holds one acceleration a, so x_d moves by
    T_s ẋ_d + T_s² a/2 and ẋ_d by T_s a exactly. The preview rolls the same filter forward with the raw
    target frozen; those states are kept and become the next ticks' reference if the raw target stays.

    Attributes:
        raw: where the hand is: (m,) coordinates, or a rotation matrix (3, 3).
        caps: caps on speed, acceleration and jerk of the filtered motion.
    """

    def __init__(
        self, value: Array, caps: Caps = POSITION_CAPS, axes: list[int] | slice | None = None
    ) -> None:
        """Starts at rest at `value`. `axes` picks the components of a rotation's motion that a task sees."""
        value = np.array(value, float)
        self.raw = value
        self.caps = caps
        self._rotation = value.ndim == 2
        self._axes = axes
        zero = np.zeros(3 if self._rotation else value.size)
        self._samples: deque[_Sample] = deque([_Sample(value, zero, zero, zero)])
        self._time: float | None = None
        self._period = 0.0
        self._rest: tuple[int, Preview] | None = None

    @property
    def value(self) -> Array:
        """x_d now."""
        return self._samples[0].value

    def move(self, raw: Array) -> None:
        """Puts the hand somewhere else. The motion so far continues smoothly from where it is."""
        self.raw = np.array(raw, float)
        self._forget_future()

    def jump(self, value: Array) -> None:
        """Puts hand and reference to `value`, at rest (for resets)."""
        self.__init__(value, self.caps, self._axes)

    def _forget_future(self) -> None:
        first = self._samples[0]
        self._samples = deque([first])
        self._rest = None

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        """The filtered motion at t … t + N·T_s; each later t advances the filter by one period."""
        if T_s != self._period:
            self._period = T_s
            self._forget_future()
        if self._time is not None and t > self._time:
            if len(self._samples) == 1:
                self._samples.append(self._next(self._samples[0], T_s))
            self._samples.popleft()
        self._time = t
        if self._rest is not None and self._rest[0] == N:
            return self._rest[1]
        while len(self._samples) < N + 1:
            self._samples.append(self._next(self._samples[-1], T_s))
        return self._gather(N)

    def _gather(self, N: int) -> Preview:
        samples = [self._samples[j] for j in range(N + 1)]
        displacement = np.cumsum([np.zeros_like(samples[0].step), *(s.step for s in samples[1:])], axis=0)
        velocity = np.array([s.velocity for s in samples])
        acceleration = np.array([s.acceleration for s in samples])
        if self._axes is not None:
            displacement, velocity, acceleration = (
                array[:, self._axes] for array in (displacement, velocity, acceleration)
            )
        preview = Preview(samples[0].value, displacement, velocity, acceleration)
        if samples[0].value is self.raw:
            self._rest = (N, preview)
        return preview

    def _distance(self, value: Array) -> Array:
        return log3(self.raw @ value.T) if self._rotation else self.raw - value

    def _next(self, now: _Sample, T_s: float) -> _Sample:
        if now.value is self.raw:
            zero = np.zeros_like(now.velocity)
            return _Sample(self.raw, zero, zero, zero)
        caps = self.caps
        away = self._distance(now.value)
        distance = math.sqrt(float(away @ away))
        speed = math.sqrt(float(now.velocity @ now.velocity))
        if distance < _STILL and speed < _STILL * 10:
            zero = np.zeros_like(now.velocity)
            return _Sample(self.raw, zero, zero, away)
        # Never faster than a stop with half the acceleration cap allows; linear close to the goal.
        wanted_speed = min(caps.speed, _APPROACH * distance, math.sqrt(caps.acceleration * distance))
        wanted = away * (wanted_speed / distance) if distance > 0 else 0 * away
        acceleration = _limited(_RATE * (wanted - now.velocity), caps.acceleration)
        acceleration = now.acceleration + _change(now, acceleration, speed, caps, T_s)
        velocity = _limited(now.velocity + T_s * acceleration, caps.speed)
        acceleration = (velocity - now.velocity) / T_s
        step = 0.5 * T_s * (now.velocity + velocity)
        value = exp3(step) @ now.value if self._rotation else now.value + step
        return _Sample(value, velocity, acceleration, step)


def _change(now: _Sample, wanted: Array, speed: float, caps: Caps, T_s: float) -> Array:
    """How the acceleration changes in one period towards the one wanted, within the jerk cap.

    Speeding up must end at the speed cap: along the motion the acceleration stays below √(jerk · speed left),
    half of what a straight line would allow, since in a curve speed also grows by itself. If it is above
    already, coming down has the first claim on the jerk.
    """
    budget = caps.jerk * T_s
    if speed == 0.0:
        return _limited(wanted - now.acceleration, budget)
    forward = now.velocity / speed
    most = math.sqrt(caps.jerk * max(caps.speed - speed, 0.0))
    wanted = wanted - max(float(wanted @ forward) - most, 0.0) * forward
    change = wanted - now.acceleration
    if float(now.acceleration @ forward) <= most:
        return _limited(change, budget)
    along = max(float(change @ forward), -budget)
    across = change - float(change @ forward) * forward
    return along * forward + _limited(across, math.sqrt(max(budget**2 - along**2, 0.0)))


def _limited(vector: Array, cap: float) -> Array:
    """The vector, shortened to `cap` if it is longer."""
    length = math.sqrt(float(vector @ vector))
    return vector if length <= cap else vector * (cap / length)
