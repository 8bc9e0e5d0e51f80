"""The settings of distances that are kept at torque level."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from robots.ranges import Range, Shown, check_fields

MOST = 8
"""Largest number of pairs with a row; a robot with fewer joints has as many rows as joints."""


@dataclass(frozen=True)
class Avoidance:
    """Settings of the distances that are kept between links, and between links and objects.

    Attributes:
        deceleration: the deceleration in m/s² of a pair that comes closer, as the bound assumes.
        pull: m, the largest error on which tasks of positions act while `on` or with `Limits.stall_guard`;
            for other tasks the largest error is TURN_PULL · pull, rad. A larger error, for example of a
            target that cannot be reached, acts like the largest one. 0: no limit.
    """

    # fmt: off
    on: Annotated[bool, Shown(
        "Keep distances", "Keep distances between links, and between links and objects. himpc, hiqp, nhimpc, "
        "weighted and himpc_printed do this by bounds above all levels, himpc_filtered by a filter behind "
        "its levels",
        tries=("true", "false"), name="distances kept", group="Distances")] = False
    d_safe: Annotated[float, Range(0.0, 0.2), Shown(
        "d_safe", "Smallest distance that is allowed", "m", 0.0, 100.0, 1.0, page_unit="mm", factor=1000.0,
        name="safe distance", group="Distances")] = 0.01
    margin: Annotated[float, Range(0.0, 0.2), Shown(
        "Margin", "Added to d_safe, for the delay of time-delay estimation", "m", 0.0, 100.0, 1.0,
        page_unit="mm", factor=1000.0, name="margin of distances", group="Distances")] = 0.01
    reaction: Annotated[float, Range(0.0, 2.0), Shown(
        "Reaction", "Time that the bound assumes before the robot brakes", "s", 0.0, 1.0, 0.01,
        name="reaction of distances", group="Distances")] = 0.2
    deceleration: Annotated[float, Range(0.01, 100.0), Shown(
        "Deceleration", "Deceleration that the bound assumes for the approach to an object", "m/s²", 0.1,
        20.0, 0.1, name="deceleration of distances", group="Distances")] = 2.0
    pull: Annotated[float, Range(0.0, 10.0), Shown(
        "Pull", "While distances are kept or a blocked robot is guarded, a larger error of a position has "
        "the effect of this error. For other tasks the limit is five times this number, in rad. 0: no limit",
        "m", 0.0, 2.0, 0.01, name="pull of targets", group="Distances")] = 0.1
    velocity_margin: Annotated[float, Range(0.0, 0.9), Shown(
        "Free velocity",
        "Share of the velocity limits that is not used while distances are kept or a blocked robot is "
        "guarded, for the delay of time-delay estimation",
        "", 0.0, 0.5, 0.01, name="margin of velocities", group="Distances")] = 0.08
    # fmt: on

    def __post_init__(self) -> None:
        check_fields(self, "avoidance.")

    @property
    def largest_error(self) -> float:
        """The largest error on which tasks act, m or rad."""
        return self.pull if self.on and self.pull > 0.0 else math.inf
