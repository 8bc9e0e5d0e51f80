"""Numbers about a run, described as data: a signal over time, a window, a statistic."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal, Protocol

import numpy as np

from himpc.constants import AT_POSITION, AT_TORQUE, AT_VELOCITY
from robots.arrays import Array

Statistic = Literal["largest", "smallest", "rms", "mean", "range", "last", "sum"]

UNITS: dict[str, float] = {
    "": 1.0,
    "×": 1.0,
    "s": 1.0,
    "m": 1.0,
    "mm": 1e3,
    "µm": 1e6,
    "deg": 180 / math.pi,
    "deg/s": 180 / math.pi,
    "rad/s": 1.0,
    "rad/s²": 1.0,
    "N·m": 1.0,
    "N": 1.0,
    "m/s²": 1.0,
    "%": 100.0,
    "µs": 1.0,
}
"""Factor from the unit that telemetry records (s, m, rad, N·m, share) to each unit."""

_NAMES = {
    "place": "tasks completed",
    "q": "angle",
    "v": "speed",
    "tau": "torque",
    "delta_tau": "change of torque",
    "step_us": "computing time",
}
_PER_JOINT = ("q", "v", "tau")


class RunRows(Protocol):
    """A finished or unfinished run. A field of telemetry over time is read by its name, (ticks, width)."""

    def __getitem__(self, field: str, /) -> Array: ...


@dataclass(frozen=True)
class Signal:
    """One number per tick.

    Attributes:
        name: a key of DERIVED, or a field of telemetry (`himpc.telemetry.Layout`).
        unit: a key of UNITS.
        column: index of a component of the field; None: the field's Euclidean norm.
    """

    name: str
    unit: str = ""
    column: int | None = None

    def __post_init__(self) -> None:
        if self.unit not in UNITS:
            raise ValueError(f"signal '{self.name}': unit '{self.unit}' is not one of {', '.join(UNITS)}")

    @property
    def words(self) -> str:
        """The name of the signal in legends."""
        base, _, of = self.name.partition("/")
        plain = f"{base} of {of}" if of else _NAMES.get(base, base.replace("_", " "))
        if self.column is None:
            return plain
        part = "of joint" if self.name in _PER_JOINT else "component"
        return f"{plain} {part} {self.column + 1}"

    def over(self, rows: RunRows) -> Array:
        """Returns the signal at every tick, (ticks,); NaN where it is not defined."""
        values = DERIVED[self.name](rows) if self.name in DERIVED else rows[self.name]
        one = np.linalg.norm(values, axis=1) if self.column is None else values[:, self.column]
        # The norm of a single component would not keep the sign of the component.
        one = values[:, 0] if values.shape[1] == 1 else one
        return UNITS[self.unit] * one


@dataclass(frozen=True)
class Measure:
    """One number about a run.

    Attributes:
        signal: the signal.
        statistic: "largest" absolute value, "smallest" value, "rms", "mean", "range" (greatest minus least),
            "last" (mean over the last 50 ms, at least one tick) or "sum".
        after, until: start and end of the window, s.
        over_ghost: whether the number is divided by the same number of the ghost's run. The unit is then "×".
    """

    signal: Signal
    statistic: Statistic = "largest"
    after: float = 0.0
    until: float = math.inf
    over_ghost: bool = False

    @property
    def words(self) -> str:
        """The name of the measure in tables and on the page."""
        since = f" from {self.after:g} s" if self.after > 0 else ""
        until = f" until {self.until:g} s" if math.isfinite(self.until) else ""
        ghost = ", over the ghost's" if self.over_ghost else ""
        return f"{_WORDS[self.statistic]} {self.signal.words}{since}{until}{ghost}"

    @property
    def unit(self) -> str:
        """The unit of the value."""
        return "×" if self.over_ghost else self.signal.unit

    @property
    def alone(self) -> Measure:
        """The measure without the comparison with the ghost."""
        return replace(self, over_ghost=False)

    def value(self, rows: RunRows, ghost: RunRows | None = None) -> float:
        """Returns the value so far; NaN if there is nothing to measure. `rows` may be an unfinished run."""
        own = self._of(rows)
        if not self.over_ghost:
            return own
        other = math.nan if ghost is None else self._of(ghost)
        return own / other if other else math.nan

    def _of(self, rows: RunRows) -> float:
        t = rows["t"][:, 0]
        inside = (t >= self.after - 1e-9) & (t < self.until - 1e-9)
        values = self.signal.over(rows)[inside]
        known = np.isfinite(values)
        values, t = values[known], t[inside][known]
        if self.statistic == "last" and t.size:
            values = values[t > t[-1] - _END + 1e-9]
        return float(_STATISTICS[self.statistic](values)) if values.size else math.nan


def _shares(rows: RunRows, value: str, limit: str) -> Array:
    """Returns the largest |value| / limit over the joints that have a limit, (ticks, 1)."""
    with np.errstate(all="ignore"):
        share = np.abs(rows[value]) / rows[limit]
    return np.where(np.isfinite(share), share, 0.0).max(axis=1, keepdims=True)


def _position_share(rows: RunRows) -> Array:
    """Returns the largest distance of a joint from the middle of its range, divided by half the range,
    (ticks, 1)."""
    lower, upper = rows["q_lower"], rows["q_upper"]
    with np.errstate(all="ignore"):
        share = np.abs(rows["q"] - 0.5 * (lower + upper)) / (0.5 * (upper - lower))
    return np.where(np.isfinite(share), share, 0.0).max(axis=1, keepdims=True)


_CLOSE = math.radians(0.05)
_NEAR = math.radians(5.0)


def _ahead(rows: RunRows) -> Array:
    """Returns the distance of each joint from the end of its range towards which it moves, (ticks, n) rad; 0
    beyond this end."""
    forward = rows["v"] > 0.0
    return np.maximum(np.where(forward, rows["q_upper"] - rows["q"], rows["q"] - rows["q_lower"]), 0.0)


def _deceleration_to_stop(rows: RunRows) -> Array:
    """Returns the largest q̇²/2d, where d is the distance of `_ahead`, (ticks, 1) rad/s². Distances below
    0.05° are left out."""
    ahead = _ahead(rows)
    deceleration = np.where(ahead > _CLOSE, rows["v"] ** 2 / (2.0 * np.maximum(ahead, _CLOSE)), math.nan)
    return np.fmax.reduce(deceleration, axis=1, keepdims=True)


def _speed_near_an_end(rows: RunRows) -> Array:
    """Returns the largest speed of the joints that are less than 5° before an end of their range, (ticks, 1)
    rad/s; NaN if there is no such joint."""
    speed = np.where(_ahead(rows) < _NEAR, np.abs(rows["v"]), math.nan)
    return np.fmax.reduce(speed, axis=1, keepdims=True)


def _at(bit: int) -> Callable[[RunRows], Array]:
    def is_at_bound(rows: RunRows) -> Array:
        bits = rows["at_bound"]
        bits = np.where(np.isfinite(bits), bits, 0).astype(np.int64)
        return (bits & bit != 0).any(axis=1, keepdims=True).astype(float)

    return is_at_bound


def _joints_moved(rows: RunRows) -> Array:
    """Returns the number of joints that are more than 1° away from their start, (ticks, 1)."""
    q = rows["q"]
    return (np.abs(q - q[:1]) > math.radians(1.0)).sum(axis=1, keepdims=True).astype(float)


def _tip_travel(rows: RunRows) -> Array:
    """Returns the distance of the value of the task `position` from its initial value, (ticks, 1) m."""
    x = rows["x/position"]
    return np.linalg.norm(x - x[:1], axis=1, keepdims=True)


def _way_of_the_base(rows: RunRows) -> Array:
    """Returns the length of the base's path since the first row, (ticks, 1) m."""
    steps = np.linalg.norm(np.diff(rows["x/base"], axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])[: len(rows["t"]), None]


def _time_at_work(rows: RunRows) -> Array:
    """Returns t while the mission has tasks that are not completed, (ticks, 1) s; afterwards NaN."""
    return np.where(rows["left"] > 0, rows["t"], math.nan)


DERIVED: Mapping[str, Callable[[RunRows], Array]] = {
    "torque share": lambda rows: _shares(rows, "tau_demand", "tau_upper"),
    "speed share": lambda rows: _shares(rows, "v", "v_limit"),
    "position share": _position_share,
    "deceleration to stop": _deceleration_to_stop,
    "speed within 5° of an end": _speed_near_an_end,
    "at a torque bound": _at(AT_TORQUE),
    "at a speed bound": _at(AT_VELOCITY),
    "at a position bound": _at(AT_POSITION),
    "joints moved": _joints_moved,
    "distance from the start": _tip_travel,
    "way of the base": _way_of_the_base,
    "time at work": _time_at_work,
}
"""Signals that are computed from the fields of telemetry. Torque shares assume symmetric bounds; the last two
signals exist in velocity-level scenes only."""


_END = 0.05
"""The time over which "last" is a mean, s."""

_WORDS: Mapping[Statistic, str] = {
    "largest": "largest",
    "smallest": "smallest",
    "rms": "RMS",
    "mean": "mean",
    "range": "range of",
    "last": "final",
    "sum": "total",
}

_STATISTICS: Mapping[Statistic, Callable[[Array], float]] = {
    "largest": lambda values: np.abs(values).max(),
    "smallest": lambda values: values.min(),
    "rms": lambda values: np.sqrt((values**2).mean()),
    "mean": lambda values: values.mean(),
    "range": lambda values: values.max() - values.min(),
    "last": lambda values: values.mean(),
    "sum": lambda values: values.sum(),
}
