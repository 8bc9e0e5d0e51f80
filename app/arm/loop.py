"""The loop that drives an arm: it reads the arm, runs one period of the exported controller, and writes the
torque."""

from __future__ import annotations

import gc
import time
from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.arm.guard import ArmGuard, Tolerances
from app.arm.orders import Orders
from app.link.ring import Block
from himpc.export.kernel.adjust import LIMITS, TARGET
from himpc.export.native import NativeController
from himpc.tick.kernel.arrays import PERIOD
from robots.arms.arm import Arm, ArmLimits, ArmLost, Reading

Array = NDArray[np.float64]

RAMP_SECONDS = 0.5
"""Time, s, in which the torque is reduced to zero at the end."""
MOST_SECONDS = 1.5
"""Time, s, after which the loop ends even if the arm still moves."""
ASKED = "the watcher requested it"
"""The reason of an end that the watcher requested."""
_STILL = 0.02  # rad/s
_CALMING = 0.3  # torque that brakes a joint at its largest velocity, as a share of its largest torque
_MOVED = 0.02  # rad, allowed motion between the first reading of the arm and the start of the loop


class Columns(NamedTuple):
    """Columns of the rows that the loop writes: time (s); q and v of the arm (rad, rad/s); the torque of the
    previous period and the new torque (N·m, without gravity); the number of periods missed before; the time
    that the controller and its guard took (µs); the fallback; the number of orders received so far; whether
    the loop is ending; and the errors of all tasks (m, rad)."""

    t: int
    q: slice
    v: slice
    tau_0: slice
    tau: slice
    missed: int
    us: int
    fallback: int
    orders: int
    ending: int
    error: slice
    width: int

    @classmethod
    def of(cls, n: int, M: int) -> Columns:
        """n: number of joints; M: number of rows of all tasks."""
        q, v, tau_0, tau = (slice(1 + k * n, 1 + (k + 1) * n) for k in range(4))
        rest = 1 + 4 * n
        error = slice(rest + 5, rest + 5 + M)
        return cls(0, q, v, tau_0, tau, rest, rest + 1, rest + 2, rest + 3, rest + 4, error, error.stop)


class Ended(NamedTuple):
    """The end of a loop: its reason, whether the arm came to rest under control, and the number of rows."""

    why: str
    gently: bool
    rows: int


def run(
    arm: Arm,
    controller: NativeController,
    limits: ArmLimits,
    start: Array,
    orders: Orders,
    block: Block,
    tolerances: Tolerances,
    period: float,
    delay: int = 0,
) -> Ended:
    """Drives an arm until the watcher orders a stop or the guard finds a reason to stop. The torque is then
    reduced to zero smoothly, and the arm holds its position by itself.

    Args:
        arm: the arm, not yet under control.
        controller: the exported controller for this arm.
        limits: the limits in force, see `ArmLimits.with_robot`.
        start: (n,) rad, the joint positions at which the controller's targets begin.
        orders: the orders of the watcher.
        block: the memory for the rows.
        tolerances: see `ArmGuard`.
        period: the control period, s.
        delay: number of periods after which a torque acts; 0: the torque that the arm reports is used.
    """
    gc.collect()
    gc.disable()  # a garbage collection takes longer than a period
    cycle = _Cycle(arm, controller, limits, orders, block, period, delay)
    try:
        why = cycle.begin(start) or cycle.until(ArmGuard(limits, tolerances, period))
        return Ended(why, cycle.end(), block.count)
    except ArmLost as error:
        return Ended(f"the arm was lost: {error}", False, block.count)
    finally:
        arm.stop()
        gc.enable()


def accepted(wanted: Array, before: Array, limits: ArmLimits, period: float) -> Array:
    """Returns the torque, (n,) N·m, that is nearest to `wanted` and that an arm accepts after the torque
    `before`."""
    step = limits.tau_rate * period
    low, high = np.maximum(before - step, -limits.tau), np.minimum(before + step, limits.tau)
    return np.minimum(np.maximum(wanted, low), high)


class _Cycle:
    """The state of a loop between two periods."""

    def __init__(
        self,
        arm: Arm,
        controller: NativeController,
        limits: ArmLimits,
        orders: Orders,
        block: Block,
        period: float,
        delay: int,
    ) -> None:
        self._arm, self._controller, self._orders, self._block = arm, controller, orders, block
        self._limits, self._period = limits, period
        self._error, self._scalars = controller.view("error"), controller.view("scalars")
        self._at = Columns.of(controller.n, self._error.size)
        self._row = np.zeros(self._at.width)
        self._tau = np.zeros(controller.n)
        self._sent = deque([self._tau] * (delay + 1), delay + 1)
        self._t: float | None = None

    def begin(self, start: Array) -> str | None:
        """Takes control of the arm; returns None, or the reason why this is impossible."""
        limits = self._limits
        self._controller.set(LIMITS, 0, [*limits.tau, *limits.v, *limits.q_lower, *limits.q_upper])
        reading = self._next()
        # The measured torque excludes gravity. The controller's increments start from it.
        self._tau = reading.tau
        self._controller.reset(reading.tau)
        moved = np.abs(reading.q - start).max()
        self._set(reading, self._tau, 0, time.perf_counter(), False)
        return f"the arm has moved by {moved:.3f} rad after its pose was read" if moved > _MOVED else None

    def until(self, guard: ArmGuard) -> str:
        """Runs until there is a reason to end, and returns the reason."""
        while True:
            reading = self._next()
            begun = time.perf_counter()
            for order in self._orders.news():
                self._controller.set(TARGET, order.task, order.values)
            # Accelerations are differences over the time that has really passed.
            self._scalars[PERIOD] = (1 + self._row[self._at.missed]) * self._period
            applied = self._sent[0] if len(self._sent) > 1 else reading.tau
            wanted, fallback = self._controller.tick(reading.q, reading.v, applied)
            hurried = self._set(reading, wanted, fallback, begun, False)
            why = guard.check(
                reading, int(self._row[self._at.missed]), hurried, fallback, self._orders.beats, begun
            )
            if why is not None or self._orders.stopped:
                return why or ASKED

    def end(self) -> bool:
        """Reduces the torque to zero: τ = s τ₀ − D q̇, with s from 1 to 0 and D = 0.3 τ_max/q̇_max; returns
        whether the arm stands still."""
        calm = _CALMING * self._limits.tau / self._limits.v
        first, began = self._tau, self._t or 0.0
        while True:
            reading = self._next()
            begun, passed = time.perf_counter(), reading.t - began
            share = max(0.0, 1.0 - passed / RAMP_SECONDS)
            v = np.clip(np.nan_to_num(reading.v), -self._limits.v, self._limits.v)
            self._set(reading, share * first - calm * v, 0, begun, True)
            still = bool((np.abs(reading.v) < _STILL).all())
            if (share == 0.0 and still) or passed > MOST_SECONDS:
                return still

    def _next(self) -> Reading:
        reading = self._arm.read()
        passed = 1 if self._t is None else round((reading.t - self._t) / self._period)
        self._t = reading.t
        self._row[self._at.missed] = max(0, passed - 1)
        return reading

    def _set(self, reading: Reading, wanted: Array, fallback: int, begun: float, ending: bool) -> bool:
        """Sets the torque nearest to `wanted` that the arm accepts, and writes the row; returns whether
        `wanted` changes faster than the arm accepts."""
        tau = accepted(wanted, self._tau, self._limits, self._period)
        hurried = bool((np.abs(wanted - self._tau) > self._limits.tau_rate * self._period).any())
        us = 1e6 * (time.perf_counter() - begun)
        self._arm.write(tau)
        self._tau = tau
        self._sent.append(tau)
        row, at = self._row, self._at
        row[at.t], row[at.q], row[at.v], row[at.tau_0] = reading.t, reading.q, reading.v, reading.tau
        row[at.tau], row[at.fallback], row[at.ending] = tau, fallback, ending
        row[at.error], row[at.orders] = self._error, self._orders.taken
        row[at.us] = us
        self._block.write(row)
        return hurried
