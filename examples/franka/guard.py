"""The limits of an arm, and the conditions that end its control. No torque contains gravity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import FALLBACKS
from robots import InputError, Robot

Array = NDArray[np.float64]


class Reading(NamedTuple):
    """q, rad; v, rad/s; tau: the torque that acted in the last period, N·m; t: the arm's clock, s."""

    q: Array
    v: Array
    tau: Array
    t: float


class Limits(NamedTuple):
    """Largest torque, N·m, its largest change, N·m/s, largest velocity, rad/s, and joint ranges, rad."""

    tau: Array
    tau_rate: Array
    v: Array
    q_lower: Array
    q_upper: Array

    def with_robot(self, robot: Robot, q: Array) -> Limits:
        """Returns limits that also satisfy a robot's description. Raises InputError if a joint is outside."""
        low, high = np.maximum(self.q_lower, robot.q_lower), np.minimum(self.q_upper, robot.q_upper)
        for j in np.flatnonzero((q <= low) | (q >= high)):
            outside = f"is at {q[j]:.3f} rad, outside {low[j]:.3f} … {high[j]:.3f} rad"
            raise InputError(f"joint '{robot.joint_names[j]}' of the arm {outside}: move it by hand")
        tau, v = np.minimum(self.tau, robot.tau_limit), np.minimum(self.v, robot.v_limit)
        return Limits(tau, self.tau_rate, v, low, high)

    def accepted(self, wanted: Array, before: Array, period: float) -> Array:
        """Returns the torque nearest to `wanted` that the arm accepts after the torque `before`."""
        step = self.tau_rate * period
        return np.clip(np.clip(wanted, before - step, before + step), -self.tau, self.tau)


@dataclass(frozen=True)
class Tolerances:
    """The control ends when one of them is exceeded. Whole numbers count periods one after another."""

    missed: int = 10  # missed periods
    missed_share: float = 0.2  # share of the periods that are missed, averaged over about a second
    rate: int = 25  # periods in which the controller requests a faster change of torque than is accepted
    lost: int = 10  # periods in which the controller finds no torque
    silent: float = 0.5  # s, for which the watcher is silent or behind the arm
    distance: float = 0.2  # rad, of a joint from the simulated joint; the watcher compares them


class Guard:
    """Checks every period of a loop. The loop must end when `check` returns a reason."""

    def __init__(self, limits: Limits, tolerances: Tolerances, period: float) -> None:
        self._limits, self._most, self._period = limits, tolerances, period
        self._share, self._hurried, self._lost = 0.0, 0, 0

    def check(
        self, t: float, reading: Reading, missed: int, hurried: bool, fallback: int, at: float, away: Array
    ) -> str | None:
        """Returns why the control must end at t, s after the start, or None. missed: periods
        missed before; hurried: whether the requested torque changed faster than the arm accepts; fallback:
        an index of `FALLBACKS`; at: the time, s, of the newest measurement that the watcher has compared
        with the model; away: the distance of the joints then, (n,) rad."""
        most, limit, v = self._most, self._limits.v, np.abs(reading.v)
        self._share += (missed / (1 + missed) - self._share) * min(1.0, self._period * (1 + missed))
        self._hurried = self._hurried + 1 if hurried else 0
        self._lost = self._lost + 1 if FALLBACKS[fallback] == "hold" else 0
        if missed > most.missed:
            return f"{missed} periods were missed one after another"
        if self._share > most.missed_share:
            return f"{100 * self._share:.0f} % of the periods were missed during the last second"
        if not (np.isfinite(reading.q).all() and np.isfinite(v).all()):
            return "the measured state is not finite"
        if (v > limit).any():
            j = int(np.argmax(v - limit))
            return f"joint {j + 1} moves with {v[j]:.2f} rad/s, and its limit is {limit[j]:.2f} rad/s"
        if self._hurried > most.rate:
            return f"the requested torque changed too fast in {self._hurried} periods one after another"
        if self._lost > most.lost:
            return f"the controller had no torque in {self._lost} periods one after another"
        if not away.max() <= most.distance:
            return f"joint {away.argmax() + 1} is {away.max():.2f} rad away from the model"
        if t - at > most.silent:
            return f"the watcher has been silent for {t - at:.1f} s"
        return None
