"""Shared functions for tests of HTMPC: a stack, previews, and a reference solution of Algorithm 1 by a
general NLP solver."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.optimize import minimize

from himpc import FramePosition, Level
from himpc.htmpc import HTMPCSettings, MotionLimits, VelocityPlan
from himpc.htmpc.problem import PROXIMAL
from himpc.references import Hold, Preview, Reference
from himpc.stack import Stack
from robots import Robot

Array = NDArray[np.float64]

FREE = MotionLimits(position=False, velocity=False, acceleration=False, jerk=False)


def mobile_stack(Q: float = 10.0) -> Stack:
    return (
        Level((FramePosition(name="ee"),), Q=Q),
        Level((FramePosition(name="base", frame="base", axes="xy"),), Q=Q),
    )


def mobile_settings(**changes: Any) -> HTMPCSettings:
    return replace(HTMPCSettings(mobile_stack()), **changes)


def point(robot: Robot, q: Array, frame: str = "") -> Array:
    """Returns the world position of a frame, (3,), computed only with Pinocchio."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return data.oMf[robot.frame_id(frame or robot.tip)].translation.copy()


def previews(references: Mapping[str, Reference], t: float, settings: HTMPCSettings) -> dict[str, Preview]:
    return {
        name: each.preview(t + settings.delay_s, settings.dt, settings.horizon)
        for name, each in references.items()
    }


class Steps(Protocol):
    @property
    def settings(self) -> HTMPCSettings: ...

    def step(self, q: Array, v: Array, previews: Mapping[str, Preview]) -> VelocityPlan: ...


def closed_loop(
    controller: Steps,
    references: Mapping[str, Reference],
    q: Array,
    seconds: float,
    before: Callable[[int], None] | None = None,
) -> tuple[list[VelocityPlan], Array]:
    """Runs the controller with a plant that follows the commands exactly; returns plans and true positions
    (ticks, n)."""
    v = np.zeros_like(q)
    plans, path = [], []
    period = controller.settings.period
    for tick in range(round(seconds / period)):
        if before is not None:
            before(tick)
        period = controller.settings.period
        path.append(q)
        plan = controller.step(q, v, previews(references, tick * period, controller.settings))
        plans.append(plan)
        q, v = plan.motion.position(period), plan.motion.velocity(period)
    return plans, np.array(path)


def at_home(robot: Robot, base: Array) -> dict[str, Reference]:
    """Returns references: the end-effector stays at its position at home, and the base goes to a point
    (2,)."""
    return {"ee": Hold(point(robot, robot.home)), "base": Hold(base)}


class Oracle:
    """Solves Algorithm 1 on (9) with SLSQP, with an independent implementation of kinematics, costs and
    constraints."""

    def __init__(
        self, robot: Robot, settings: HTMPCSettings, goals: list[tuple[str, list[int], Array]]
    ) -> None:
        """goals: for each level a frame, the controlled axes, and the point to reach at every knot."""
        self.robot, self.settings, self.goals = robot, settings, goals
        self.q, self.v = robot.home.copy(), np.zeros(robot.n)

    def states(self, u: Array) -> tuple[Array, Array]:
        """Returns positions and velocities at knots 1 … N, integrated step by step."""
        dt, q, v = self.settings.dt, self.q, self.v
        Q, V = [], []
        for a in u.reshape(-1, self.robot.n):
            q, v = q + dt * v + 0.5 * dt * dt * a, v + dt * a
            Q.append(q)
            V.append(v)
        return np.array(Q), np.array(V)

    def errors(self, level: int, u: Array) -> Array:
        """Returns the errors of a level, (N, m)."""
        frame, axes, goal = self.goals[level]
        return np.array([point(self.robot, q, frame)[axes] - goal for q in self.states(u)[0]])

    def tracking(self, level: int, u: Array) -> float:
        """Returns the tracking cost (8) without knot 0."""
        e, weight = self.errors(level, u), float(np.asarray(self.settings.stack[level].Q))
        return 0.5 * weight * float((e[:-1] ** 2).sum() + self.settings.terminal * (e[-1] ** 2).sum())

    def effort(self, u: Array) -> float:
        """Returns the effort cost (10)."""
        settings = self.settings
        S, R, W = (
            float(np.asarray(each))
            for each in (settings.velocity_effort, settings.input_effort, settings.change_effort)
        )
        inputs = u.reshape(-1, self.robot.n)
        change = np.diff(np.vstack([np.zeros(self.robot.n), inputs]), axis=0)
        return 0.5 * float(S * (self.states(u)[1] ** 2).sum() + R * (u**2).sum() + W * (change**2).sum())

    def solve(self, delta: float, start: Array) -> list[Array]:
        """Returns the inputs after every level, with (12) relaxed by δ. Upper levels have a share of the
        effort, and the robot starts at rest."""
        found: list[Array] = []
        constraints: list[dict[str, Any]] = []
        u = start.ravel()
        for level in range(len(self.goals)):
            share = 1.0 if level == len(self.goals) - 1 else PROXIMAL
            solution = minimize(
                lambda u, level=level, share=share: self.tracking(level, u) + share * self.effort(u),
                u,
                method="SLSQP",
                constraints=constraints,
                options={"maxiter": 300, "ftol": 1e-12},
            )
            assert solution.success, solution.message
            u = solution.x
            found.append(u)
            bound = np.abs(self.errors(level, u)).ravel() + delta
            for side in (1.0, -1.0):
                constraints.append(
                    {
                        "type": "ineq",
                        "fun": lambda u, level=level, bound=bound, side=side: (
                            bound - side * self.errors(level, u).ravel()
                        ),
                    }
                )
        return found


def lexicographically_less(one: Array, other: Array, tolerance: Array) -> bool:
    """Whether `one` is lexicographically less than `other` by Definition III.1; entries whose difference is
    within the tolerance count as equal."""
    for a, b, equal in zip(one, other, tolerance, strict=True):
        if abs(a - b) > equal:
            return bool(a < b)
    return False
