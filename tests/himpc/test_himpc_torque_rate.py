"""In closed loop, the kernel and the printed equations keep and report the bound on the torque rate and a
constraint that only this test defines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from broken_solver import break_kernel
from closed_loop import Loop, holding
from numpy.typing import NDArray
from printed_levels import off_printed

from himpc.limits import CONSTRAINTS, TORQUE, TORQUE_RATE, constraints
from himpc.limits.constraint import Block, Constraint, Directions, Moment
from himpc.limits.constraints import bit_of
from himpc.limits.velocity import summed_twice
from himpc.plan import write_plan
from himpc.references import Outlook
from himpc.telemetry import layout_of

Array = NDArray[np.float64]

RATE = 5.0
"""N·m/s."""
FASTEST = 0.02
"""Largest sum of the first two velocities, rad/s."""


def pulled(name: str, controller: str = "himpc", rate: float = 0.0) -> Loop:
    """Returns a loop in which the target of the hand jumps by 5 cm."""
    loop = holding(name, controller)
    settings = loop.controller.settings
    loop.controller.configure(replace(settings, limits=replace(settings.limits, torque_rate=rate)))
    target = loop.references["position"]
    target.move(target.preview(0.0, 1e-3, 1).value + 0.05)  # pyright: ignore[reportAttributeAccessIssue]
    return loop


def names(loop: Loop) -> tuple[str, ...]:
    return loop.controller.robot.joint_names  # pyright: ignore[reportAttributeAccessIssue]


@pytest.mark.parametrize("controller", ["himpc", "nhimpc", "hiqp", "weighted"])
def test_a_torque_rate_is_kept_and_binds(controller: str) -> None:
    """Without the bound, the torque of the arm changes faster. With it, the rate never exceeds the bound, and
    reaches it."""
    free, bound = (pulled("iiwa14", rate=rate, controller=controller) for rate in (0.0, RATE))
    fastest = [
        np.array([np.abs(plan.tau - plan.tau_0).max() for plan in (loop.tick().freeze() for _ in range(40))])
        for loop in (free, bound)
    ]
    assert fastest[0].max() > 1.5 * RATE * 1e-3
    assert fastest[1].max() <= RATE * 1e-3 + 1e-8
    assert (fastest[1] >= RATE * 1e-3 - 1e-8).any()


def test_who_binds_and_telemetry_tell_of_it() -> None:
    """The plan contains the joint, its label and its knot. The row has the bit of the constraint at the same
    joints, both when it is written by compiled code and field by field."""
    loop = pulled("iiwa14", rate=RATE)
    robot, stack = loop.controller.robot, loop.controller.settings.stack  # pyright: ignore[reportAttributeAccessIssue]
    layout, told = layout_of(robot, stack), 0
    for _ in range(30):
        plan = loop.tick().freeze()
        bound = {each.joint for each in plan.binding(names(loop)) if each.kind == "torque rate"}
        rows = [np.full(layout.size, np.nan) for _ in range(2)]
        ahead = Outlook(loop.references, loop.plant.t, 1e-3, 5)
        for row, source in zip(rows, (plan, replace(plan, fill=None)), strict=True):
            write_plan(row, layout, source, ahead)
            marks = row[layout.fields["at_bound"]].astype(int) & bit_of(TORQUE_RATE)
            assert {name for name, mark in zip(names(loop), marks, strict=True) if mark} == bound
        told += bool(bound)
    assert told


@pytest.mark.parametrize("rate", [0.0, RATE])
def test_kernel_and_printed_equations_agree_in_the_loop(rate: float) -> None:
    """At every tick both agree on the same problems and rows, and himpc_printed gives the same torques."""
    loop, other = pulled("planar3", rate=rate), pulled("planar3", "himpc_printed", rate)
    for _ in range(25):
        plan, printed = loop.tick().freeze(), other.tick()
        assert off_printed(loop.controller, plan) <= 1e-8
        assert np.abs(plan.tau - printed.tau).max() <= 1e-7


def test_without_any_optimum_the_arm_brakes_within_torque_and_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernel is broken while the arm moves. The arm comes to rest, and no torque or torque rate exceeds
    its bound."""
    loop = pulled("iiwa14", rate=10 * RATE)
    for _ in range(60):
        loop.tick()
    before = np.abs(loop.plant.v).max()
    break_kernel(monkeypatch)
    for _ in range(200):
        plan = loop.tick().freeze()
        assert plan.levels[0].fallback in ("brake", "previous", "feasible")
        assert np.abs(plan.tau - plan.tau_0).max() <= 10 * RATE * 1e-3 + 2e-7
        assert (np.abs(plan.tau) <= plan.limits.tau_upper).all()
    assert before > 0.02 and np.abs(loop.plant.v).max() < 0.3 * before


def _bounds(now: Moment) -> Block:
    """Returns the block of |q̇_1 + q̇_2| ≤ FASTEST at every knot."""
    N, n = now.N, now.tau_0.size
    gradient = np.zeros(n)
    gradient[:2] = 1.0
    D = np.zeros((n, n))
    size = np.linalg.norm(gradient / now.M_bar)
    D[0] = gradient / now.M_bar / size
    free = (now.state.v + now.state.gained_velocity(N, now.T_s)) @ gradient
    lower, upper = np.full((N, n), -np.inf), np.full((N, n), np.inf)
    lower[:, 0], upper[:, 0] = ((side * FASTEST - free) / (now.T_s * size) for side in (-1.0, 1.0))
    return Block(lower, upper, Directions(D, ("both", *("",) * (n - 1))))


SUM = Constraint("sum of velocities", summed_twice, 1, hard=False, is_on=lambda _: True, bounds=_bounds)


@pytest.mark.parametrize("controller", ["himpc", "himpc_printed"])
def test_a_constraint_that_couples_joints_is_one_entry_of_the_list(
    monkeypatch: pytest.MonkeyPatch, controller: str
) -> None:
    """In the list, the constraint is kept by the controller, reported by its name and marked at both joints;
    outside the list, it is violated. Time-delay estimation overruns a velocity bound by some percent, see
    `velocity_approach`."""

    def fastest(loop: Loop) -> tuple[float, list[str]]:
        found, told = 0.0, []
        for _ in range(50):
            plan = loop.tick().freeze()
            told += [each.joint for each in plan.binding(names(loop)) if each.kind == "sum of velocities"]
            found = max(found, abs(float(loop.plant.v[:2].sum())))
            assert off_printed(loop.controller, plan) <= 1e-8
        return found, told

    free, nothing = fastest(pulled("planar3", controller))
    monkeypatch.setattr(constraints, "CONSTRAINTS", (*CONSTRAINTS, SUM))
    bound, told = fastest(pulled("planar3", controller))
    assert free > 2 * FASTEST and not nothing
    assert bound <= 1.2 * FASTEST and set(told) == {"both"}
    assert bit_of(SUM) == 1 << len(CONSTRAINTS) and bit_of(TORQUE) == 1
