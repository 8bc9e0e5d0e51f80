"""The loop of an arm, at 1 kHz: read, one period of the exported controller, write. Drags are timed here, by
the arm's own clock; no other process can delay them."""

from __future__ import annotations

import gc
import mmap
import signal
import time
from collections import deque
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from examples.franka.franka import ArmLost
from examples.franka.guard import Array, Guard, Limits, Reading, Tolerances
from himpc.export.kernel.adjust import LIMITS, TARGET
from himpc.export.native import NativeController
from himpc.tick.kernel.arrays import PERIOD

RAMP_SECONDS, MOST_SECONDS = 0.5, 1.5  # of a gentle stop: until the torque is zero, and at most
_STILL = 0.02  # rad/s
_CALMING = 0.3  # torque that brakes a joint at its largest velocity, as a share of its largest torque
_MOVED = 0.02  # rad, allowed motion between the first reading of the arm and the start of the loop


class Ended(NamedTuple):
    """Why a drive ended, whether this was wanted, and whether the arm came to rest under control."""

    why: str
    wanted: bool
    gently: bool


@dataclass(frozen=True)
class Plan:
    """A drive: limits in force; the pose, rad, at which the targets begin; period and duration, s; drags: (s
    after the start, task, values as of `himpc_set`); delay: periods after which a torque acts, 0: as the arm
    reports; stuck: time, s, after which a call of the arm ends the process, 0: never."""

    limits: Limits
    start: Array
    period: float
    duration: float
    drags: tuple[tuple[float, int, Array], ...] = ()
    tolerances: Tolerances = field(default_factory=Tolerances)
    delay: int = 0
    stuck: float = 0.0

    def begin(self, controller: NativeController, tau: Array) -> None:
        """tau: the torque without gravity that acts, from which the controller's increments start."""
        limits = self.limits
        controller.set(LIMITS, 0, [*limits.tau, *limits.v, *limits.q_lower, *limits.q_upper])
        controller.reset(tau)

    def drag(self, controller: NativeController, since: float, t: float) -> None:
        """Moves the targets with a time in (since, t]."""
        for at, task, values in self.drags:
            if since < at <= t:
                controller.set(TARGET, task, values)


class Shared:
    """Memory of loop and watcher; neither waits for the other. The loop writes `rows` and their `count`. The
    watcher writes `q_model`, its joints at these rows, and `watched` and `away`, see `Guard`."""

    def __init__(self, plan: Plan, errors: int) -> None:
        numbers = [(name, float) for name in ("t", "missed", "us", "fallback", "ending")]
        vectors = [(name, float, len(plan.start)) for name in ("q", "v", "tau_0", "tau")]
        kind = np.dtype([*numbers, *vectors, ("error", float, errors)])
        n, most = len(plan.start), round((plan.duration + 2 * MOST_SECONDS) / plan.period)
        self.rows, self.q_model = _memory(most, kind), _memory((most, n), float)
        self.count, self.watched, self.away = _memory(1, np.int64), _memory(1, float), _memory(n, float)


def _memory(shape: Any, kind: Any) -> Array:
    """Returns zeros that forked processes share."""
    return np.ndarray(shape, kind, mmap.mmap(-1, int(np.prod(shape)) * np.dtype(kind).itemsize))


class Loop:
    """Drives an arm until its time is over, Ctrl-C, or until the guard finds a reason."""

    def __init__(self, arm: Any, controller: NativeController, plan: Plan, shared: Shared) -> None:
        self._arm, self._controller, self._plan, self._shared = arm, controller, plan, shared
        self._first, self._t, self.interrupted = 0.0, 0.0, False
        self._missed, self._tau, self._error = 0, np.zeros(controller.n), controller.view("error")
        self._sent = deque([self._tau] * (plan.delay + 1), plan.delay + 1)

    def run(self) -> Ended:
        gc.disable()  # a garbage collection takes longer than a period
        try:
            why, wanted = self._until_a_reason()
            return Ended(why, wanted, self._end())
        except ArmLost as error:
            return Ended(f"the arm was lost: {error}", False, False)
        finally:
            self._arm.stop()
            gc.enable()

    def _until_a_reason(self) -> tuple[str, bool]:
        plan, shared, controller = self._plan, self._shared, self._controller
        guard, scalars, t = Guard(plan.limits, plan.tolerances, plan.period), controller.view("scalars"), -1.0
        reading = self._read()
        self._first, self._missed, self._tau = reading.t, 0, reading.tau
        plan.begin(controller, reading.tau)
        self._write(reading, reading.tau, 0, time.perf_counter())
        moved = np.abs(reading.q - plan.start).max()
        if not moved <= _MOVED:
            return f"the arm has moved by {moved:.3f} rad after its pose was read", False
        while True:
            reading = self._read()
            begun, since, t = time.perf_counter(), t, reading.t - self._first
            plan.drag(controller, since, t)
            # Accelerations are differences over the time that has really passed.
            scalars[PERIOD] = (1 + self._missed) * plan.period
            acted = self._sent[0] if plan.delay else reading.tau
            wanted, fallback = controller.tick(reading.q, reading.v, acted)
            hurried = self._write(reading, wanted, fallback, begun)
            state = (t, reading, self._missed, hurried, fallback)
            why = guard.check(*state, shared.watched[0], shared.away)
            if why or self.interrupted:
                return why or "it was interrupted", not why
            if t >= plan.duration:
                return f"the {plan.duration:g} s are over", True

    def _end(self) -> bool:
        """Reduces the torque to zero: τ = s τ₀ − D q̇, with s from 1 to 0 and D = 0.3 τ_max/q̇_max; returns
        whether the arm stands still. It then holds its position by itself."""
        limits, first, began = self._plan.limits, self._tau, self._t
        while True:
            reading = self._read()
            share = max(0.0, 1.0 - (reading.t - began) / RAMP_SECONDS)
            v = np.clip(np.nan_to_num(reading.v), -limits.v, limits.v)
            wanted = share * first - _CALMING * limits.tau / limits.v * v
            self._write(reading, wanted, 0, time.perf_counter(), 1.0)
            still = bool((np.abs(reading.v) < _STILL).all())
            if (share == 0.0 and still) or reading.t - began > MOST_SECONDS:
                return still

    def _read(self) -> Reading:
        signal.setitimer(signal.ITIMER_REAL, self._plan.stuck)
        reading = self._arm.read()
        self._missed = max(0, round((reading.t - self._t) / self._plan.period) - 1)
        self._t = reading.t
        return reading

    def _write(self, reading: Reading, wanted: Array, fallback: int, begun: float, end: float = 0.0) -> bool:
        """Sets the accepted torque and writes the row; returns whether `wanted` changes too fast."""
        limits, period, k = self._plan.limits, self._plan.period, int(self._shared.count[0])
        hurried = bool((np.abs(wanted - self._tau) > limits.tau_rate * period).any())
        self._tau = limits.accepted(wanted, self._tau, period)
        us = 1e6 * (time.perf_counter() - begun)
        self._arm.write(self._tau)
        self._sent.append(self._tau)
        numbers = (reading.t - self._first, self._missed, us, fallback, end)
        self._shared.rows[k] = (*numbers, reading.q, reading.v, reading.tau, self._tau, self._error)
        self._shared.count[0] = k + 1
        return hurried
