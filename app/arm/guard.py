"""The conditions that end the control of an arm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import FALLBACKS
from robots.arms.arm import ArmLimits, Reading

Array = NDArray[np.float64]

_HOLD = FALLBACKS.index("hold")


@dataclass(frozen=True)
class Tolerances:
    """The limits of the guard. The control ends when one of them is exceeded.

    Attributes:
        missed: number of periods that may be missed one after another.
        missed_share: share of the periods that may be missed, averaged over about a second.
        rate: number of periods, one after another, in which the controller may request a faster change of
            torque than the arm accepts.
        lost: number of periods, one after another, in which the controller may have no usable state.
        silent: time, s, for which the watcher may be silent.
        distance: largest distance, rad, of a joint from the simulated joint.
    """

    missed: int = 10
    missed_share: float = 0.2
    rate: int = 25
    lost: int = 10
    silent: float = 0.5
    distance: float = 0.2


@final
class ArmGuard:
    """Checks every period of a loop. The loop must end when `check` returns a reason."""

    def __init__(self, limits: ArmLimits, tolerances: Tolerances, period: float) -> None:
        """period: the control period, s."""
        self._limits, self._tolerances, self._period = limits, tolerances, period
        self._share, self._hurried, self._lost = 0.0, 0, 0
        self._beats, self._heard = -1, 0.0

    def check(
        self, reading: Reading, missed: int, hurried: bool, fallback: int, beats: int, now: float
    ) -> str | None:
        """Returns the reason why the control must end; None if it can continue.

        Args:
            reading: the measurement of this period.
            missed: number of periods that were missed before this one.
            hurried: whether the controller requested a faster change of torque than the arm accepts.
            fallback: the fallback that acted, an index of `FALLBACKS`.
            beats: number of signs of life from the watcher so far.
            now: time, s, of this computer's clock.
        """
        tolerances = self._tolerances
        self._share += (missed / (1 + missed) - self._share) * min(1.0, self._period * (1 + missed))
        self._hurried = self._hurried + 1 if hurried else 0
        self._lost = self._lost + 1 if fallback == _HOLD else 0
        if beats != self._beats:
            self._beats, self._heard = beats, now
        fast = np.abs(reading.v) > self._limits.v
        if missed > tolerances.missed:
            return f"{missed} periods were missed one after another"
        if self._share > tolerances.missed_share:
            return f"{100 * self._share:.0f} % of the periods were missed during the last second"
        if not (np.isfinite(reading.q).all() and np.isfinite(reading.v).all()):
            return "the measured state is not finite"
        if fast.any():
            joint = int(np.argmax(fast))
            return (
                f"joint {joint + 1} moves with {abs(reading.v[joint]):.2f} rad/s, and its limit is "
                f"{self._limits.v[joint]:.2f} rad/s"
            )
        if self._hurried > tolerances.rate:
            return f"the requested torque changed too fast in {self._hurried} periods one after another"
        if self._lost > tolerances.lost:
            return f"the controller had no torque in {self._lost} periods one after another"
        if now - self._heard > tolerances.silent:
            return f"the watcher has been silent for {now - self._heard:.1f} s"
        return None
