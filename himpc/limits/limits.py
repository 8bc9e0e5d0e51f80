"""The limits of the robot: the settings that impose them, among them those of distances, and the bounds in
force."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Literal

import numpy as np

from robots import InputError, Robot
from robots.arrays import Array
from robots.ranges import SCALE, Folder, Range, Shown, check_fields

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


PositionMode = Literal["viability", "paper", "off"]


@dataclass(frozen=True)
class Limits:
    """Which bounds are imposed, and factors on the robot's own limits.

    Attributes:
        position: "viability" (the velocity bound from which the joint can still stop), "paper" (the rows
            (32d) as printed) or "off".
        velocity_approach: 1/s; the rate at which a velocity bound may be approached, relative to the
            remaining distance (a barrier: q̈ ≤ rate·(q̇_max − q̇)). Time-delay estimation needs tens of ticks
            to stop an acceleration (M̄ < M). A bound that is reached at full acceleration is overrun: on the
            iiwa's circle by 17 % with rate 0, which is (32e) as printed, and by 0.2 % with 15 (`himpc-lab
            reproduce himpc-limits`).
    """

    # fmt: off
    torque: Annotated[bool, Shown("Torque", "Impose the torque limits, (32f)", name="torque limits")] = True
    velocity: Annotated[bool, Shown(
        "Velocity", "Impose the velocity limits, (32e)", name="velocity limits")] = True
    position: Annotated[PositionMode, Shown(
        "Position", "viability: limits the speed to one from which the joint can still stop. paper: the rows "
        "as printed, which a horizon of a few milliseconds cannot keep, as the list of fallbacks shows",
        tries=("paper", "off", "viability"), name="position limits", group="Limits")] = "viability"
    torque_scale: Annotated[float, SCALE, Shown(
        "Torque scale", "One factor on the robot's torque limits", "", 0.05, 2.0, 0.01, group="Limits")] = 1.0
    velocity_scale: Annotated[float, SCALE, Shown(
        "Velocity scale", "One factor on the robot's velocity limits", "", 0.05, 2.0, 0.01, group="Limits",
    )] = 1.0
    velocity_approach: Annotated[float, Range(0.0, 1e4), Shown(
        "Approach", "Largest rate at which a joint may approach its velocity bound, relative to the "
        "remaining distance; 0: (32e) as printed", "1/s", 0.0, 100.0, 1.0)] = 15.0
    torque_rate: Annotated[float, Range(0.0, 1e5), Shown(
        "Torque rate", "Largest change of each joint's torque per second; in himpc, hiqp, nhimpc, "
        "weighted and himpc_printed this limit ranks above all levels. 0: not imposed", "N·m/s", 0.0, 2000.0,
        10.0, name="torque rate limit", group="Limits")] = 0.0
    stall_guard: Annotated[bool, Shown(
        "Rest when blocked",
        "A robot that presses, or whose tasks make no progress, comes to rest, also if no distances are "
        "kept. Without this guard, as printed, time-delay estimation increases the torque until it is at "
        "its limit. himpc, hiqp, nhimpc, weighted and himpc_printed have the guard, and always "
        "while they keep distances",
        tries=("false", "true"), name="guard of a blocked robot", group="Limits")] = False
    # fmt: on
    avoidance: Annotated[Avoidance, Folder("avoidance.")] = field(default_factory=Avoidance)

    def __post_init__(self) -> None:
        check_fields(self, "limits.")
        if 0 < self.velocity_approach < 1:
            raise InputError(
                f"limits.velocity_approach is {self.velocity_approach}: "
                "give 1 to 10000 (1/s), or 0 for (32e) as printed"
            )


POSITION_MARGIN = 0.007
"""The distance before its limit at which a joint is stopped, rad. The estimation error can move the joint
further, by up to half of this distance."""


@dataclass(frozen=True, eq=False)
class LimitsInForce:
    """The bounds of this tick, before any tightening. Bounds that are not imposed are infinite.

    Attributes:
        tau_lower, tau_upper: (n,) N·m.
        v_limit: (n,) rad/s.
        q_lower, q_upper: (n,) rad.
        a_max: (n,) rad/s², the deceleration that the viability bound assumes.
        v_before: (n,) rad/s, the velocity limits before a guard lowered them; None if no guard did.
    """

    tau_lower: Array
    tau_upper: Array
    v_limit: Array
    q_lower: Array
    q_upper: Array
    a_max: Array
    v_before: Array | None = None

    @property
    def user_v_limit(self) -> Array:
        """The velocity limits that the user has set, (n,) rad/s: those that no guard has lowered."""
        return self.v_limit if self.v_before is None else self.v_before

    def with_velocities(self, v_limit: Array) -> LimitsInForce:
        """Returns the same bounds with lower velocity limits, (n,) rad/s."""
        bounds = self.tau_lower, self.tau_upper, v_limit, self.q_lower, self.q_upper, self.a_max
        return LimitsInForce(*bounds, self.user_v_limit)

    def differs_in_velocity_only(self, other: LimitsInForce) -> bool:
        """Returns whether all arrays except `v_limit` are the same objects as in `other`."""
        return (
            self.tau_upper is other.tau_upper
            and self.tau_lower is other.tau_lower
            and self.q_upper is other.q_upper
            and self.q_lower is other.q_lower
            and self.a_max is other.a_max
        )

    @cached_property
    def torque(self) -> Array:
        """Lower and upper torque bounds, (2, n)."""
        return np.array((self.tau_lower, self.tau_upper))

    @cached_property
    def largest_torque(self) -> Array:
        """The larger magnitude of the lower and the upper torque bound, (n,) N·m."""
        return np.maximum(self.tau_upper, -self.tau_lower)

    @cached_property
    def stops(self) -> tuple[Array, Array]:
        """Positions at which joints are stopped, POSITION_MARGIN before their limits, (n,) rad each."""
        return self.q_lower + POSITION_MARGIN, self.q_upper - POSITION_MARGIN


def in_force(robot: Robot, limits: Limits) -> LimitsInForce:
    """Returns the robot's limits, scaled and switched by the settings."""
    unbounded = np.full(robot.n, np.inf)
    tau = robot.tau_limit * limits.torque_scale if limits.torque else unbounded
    position = limits.position != "off"
    return LimitsInForce(
        tau_lower=-tau,
        tau_upper=tau,
        v_limit=robot.v_limit * limits.velocity_scale if limits.velocity else unbounded,
        q_lower=robot.q_lower if position else -unbounded,
        q_upper=robot.q_upper if position else unbounded,
        a_max=robot.a_max,
    )
