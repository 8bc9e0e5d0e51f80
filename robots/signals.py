"""Signals between controller and mechanics: motors with saturation, delay and lag, and encoders with finite
resolution."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

_MEMORY_S = 1.5  # s; commands are stored for this time, which exceeds the largest delay
_SAMPLES_S = 0.3  # s; positions are stored for this time, which exceeds every control period


class PlantState(NamedTuple):
    """The measured state at time t: t in s; q (n,) rad; v (n,) rad/s."""

    t: float
    q: np.ndarray
    v: np.ndarray


class Motors:
    """Converts commands to torques on the joints: saturation, then pure delay, then first-order lag.

    Commands are stored with their times, so the internal step may change between commands.
    """

    def __init__(self, tau: np.ndarray, t: float) -> None:
        self._commands: deque[tuple[float, np.ndarray]] = deque([(t - _MEMORY_S, tau)])
        self.torque = tau.copy()  # (n,) N·m, the torque that acts on the joints

    def command(self, tau: np.ndarray, t: float) -> None:
        """Stores a clipped command with its time t, s."""
        commands = self._commands
        commands.append((t, tau))
        while len(commands) > 1 and commands[1][0] < t - _MEMORY_S:
            commands.popleft()

    def limit(self, lower: np.ndarray, upper: np.ndarray) -> None:
        """Clips the delayed commands and the present torque to changed torque limits."""
        self._commands = deque((t, np.clip(tau, lower, upper)) for t, tau in self._commands)
        self.torque = np.clip(self.torque, lower, upper)

    def advance(self, t: float, h: float, delay: float, lag: float) -> np.ndarray:
        """Returns the torque (n,), N·m, over the internal step from t to t + h (all times in s).

        Lag: τ ← τ + (1 − e^(−h/lag))(command − τ), the exact response at the end of the step.
        """
        target = self._delayed(t - delay + 0.5 * h) if delay > 0.0 else self._commands[-1][1]
        self.torque = (
            target if lag <= 0.0 else self.torque + (1.0 - np.exp(-h / lag)) * (target - self.torque)
        )
        return self.torque

    def _delayed(self, stamp: float) -> np.ndarray:
        for given, tau in reversed(self._commands):
            if given <= stamp:
                return tau
        return self._commands[0][1]


class Encoders:
    """Encoders of finite resolution: they record true positions and return measured ones."""

    def __init__(self, q: np.ndarray, v: np.ndarray, t: float) -> None:
        self._start = (t, q.copy(), v.copy())
        self._samples: deque[tuple[float, np.ndarray]] = deque([(t, q.copy())])

    def record(self, q: np.ndarray, t: float) -> None:
        """Stores the true position at time t, s."""
        samples = self._samples
        samples.append((t, q))
        while samples[0][0] < t - _SAMPLES_S:
            samples.popleft()

    def read(self, period: float, resolution: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns the measured (q, v). q is rounded to multiples of `resolution`, (n,) rad; 0 means no
        rounding.

        v is the backward difference of the rounded positions over one `period` (s). The joints are assumed to
        have moved before the reset, with the velocity that the reset sets. Reading changes nothing.
        """
        now, q = self._samples[-1]
        then, before = self._at(now - period)
        rounded = quantise(q, resolution)
        return rounded, (rounded - quantise(before, resolution)) / max(now - then, 1e-9)

    def _at(self, stamp: float) -> tuple[float, np.ndarray]:
        start, q, v = self._start
        if stamp < start - 1e-9:
            return stamp, q + v * (stamp - start)
        later = self._samples[-1]
        for sample in reversed(self._samples):
            if sample[0] <= stamp:
                return sample if stamp - sample[0] <= later[0] - stamp else later
            later = sample
        return later


def quantise(q: np.ndarray, resolution: np.ndarray) -> np.ndarray:
    """Returns q rounded to the nearest multiple of `resolution`, element by element; 0 means no rounding."""
    safe = np.where(resolution > 0.0, resolution, 1.0)
    return np.where(resolution > 0.0, np.round(q / safe) * safe, q)


def as_vector(name: str, value: np.ndarray, n: int) -> np.ndarray:
    """Returns a copy of n finite numbers. Raises ValueError, which contains the name, for any other value."""
    array = np.array(value, dtype=float)
    if array.shape != (n,) or not (math.isfinite(array.dot(array)) or np.isfinite(array).all()):
        raise ValueError(f"{name} must be {n} finite numbers, not {array}")
    return array
