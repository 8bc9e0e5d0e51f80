"""The settings of distances that are kept at torque level."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from robots.ranges import Range, check_fields

MOST = 8
"""Largest number of pairs with a row; a robot with fewer joints has as many rows as joints."""


@dataclass(frozen=True)
class Avoidance:
    """Settings of the distances that are kept between links, and between links and objects.

    Attributes:
        on: whether distances have rows.
        d_safe: m, the distance that is kept.
        margin: m, added to d_safe, to compensate for the delay of time-delay estimation.
        reaction: the time in s that passes before the robot brakes, as the bound assumes.
        deceleration: the deceleration in m/s² of a pair that comes closer, as the bound assumes.
        pull: m, the largest error on which tasks of positions act while `on` or with `Limits.stall_guard`;
            for other tasks the largest error is TURN_PULL · pull, rad. A larger error, for example of a
            target that cannot be reached, acts like the largest one. 0: no limit.
        velocity_margin: share of the velocity limits that is not used while `on` or with
            `Limits.stall_guard`. Time-delay estimation reacts late when other joints accelerate a joint
            that is at its limit.
    """

    on: bool = False
    d_safe: Annotated[float, Range(0.0, 0.2)] = 0.01
    margin: Annotated[float, Range(0.0, 0.2)] = 0.01
    reaction: Annotated[float, Range(0.0, 2.0)] = 0.2
    deceleration: Annotated[float, Range(0.01, 100.0)] = 2.0
    pull: Annotated[float, Range(0.0, 10.0)] = 0.1
    velocity_margin: Annotated[float, Range(0.0, 0.9)] = 0.08

    def __post_init__(self) -> None:
        check_fields(self, "avoidance.")

    @property
    def largest_error(self) -> float:
        """The largest error on which tasks act, m or rad."""
        return self.pull if self.on and self.pull > 0.0 else math.inf
