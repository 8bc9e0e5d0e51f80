"""In scenes that keep distances, a robot that is dragged towards an object stops before it, and
the kernel and the printed equations agree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.avoidance import generated
from himpc.controllers import stall_guard
from himpc.limits import CONSTRAINTS
from himpc.limits.distance import DISTANCE
from lessons.events import MoveTarget
from lessons.recording.run import run
from lessons.scenes.catalog import torque_scene
from lessons.scenes.scene import TorqueScene
from lessons.session.torque import TorqueSession
from lessons.settings.assignments import with_assignments

OFF = "avoidance.on=false"
DOWN = ((0.0, MoveTarget("position", (0.55, 0.1, -0.15))),)


def scene(name: str, *changes: str) -> TorqueScene:
    found = torque_scene(name)
    return replace(found, settings=with_assignments(found.settings, changes))


def test_an_arm_that_is_dragged_into_the_floor_stops_before_it_and_comes_to_rest() -> None:
    """With rows of distances the arm touches nothing, stays within its limits, and comes to rest; without
    them it hits the floor."""
    found = run(replace(scene("iiwa14-hold", "avoidance.on=true"), events=DOWN), 4.0)
    session = found.session
    assert isinstance(session, TorqueSession)
    assert found["contact_depth"].max() == 0.0
    assert float(np.abs(session.plant.v).max()) < 0.05
    assert session.diverged_at is None
    blind = run(replace(scene("iiwa14-hold", OFF), events=DOWN), 2.0)
    assert blind["contact_depth"].max() > 0.0


def guarded(monkeypatch: pytest.MonkeyPatch, change: Callable[..., None]) -> None:
    """Calls a function with the velocities and with the guard's numbers before the guard uses them: v, stall
    and mean of `slow_down`."""
    slow_down = stall_guard.slow_down

    def changed(*given: Any) -> None:
        v, stall, mean = given[3], given[11], given[13]
        change(v, stall, mean)
        slow_down(*given)

    monkeypatch.setattr(stall_guard, "slow_down", changed)


def never_stalled(_: np.ndarray, stall: np.ndarray, __: np.ndarray) -> None:
    stall[:] = 1.0, np.inf


def never_faster(v: np.ndarray, _: np.ndarray, mean: np.ndarray) -> None:
    mean[:] = v


def test_without_the_stall_the_arm_would_not_come_to_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    """The arm is dragged in the same way, but its joints may be as fast as their limits permit. They continue
    to move above the floor."""
    guarded(monkeypatch, never_stalled)
    found = run(replace(scene("iiwa14-hold", "avoidance.on=true"), events=DOWN), 4.0)
    assert float(np.abs(found["v"][-500:]).max()) > 0.2
    assert found["contact_depth"].max() == 0.0


def test_a_joint_that_others_accelerate_stays_within_its_velocity_limit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two drags with a turn move five joints of a panda near their limits at the same time. The true inertia
    of the third joint is 70 times M̄, so that its torque acts late. Without the look ahead and the margin,
    this joint overruns its limit, although every row is satisfied at every tick."""
    drags = (
        (0.0, MoveTarget("position", (0.3506, -0.1572, 0.3096))),
        (0.0, MoveTarget("orientation", (0.8861, 0.3817, -0.1184, 0.2346))),
        (1.0, MoveTarget("position", (0.6732, -0.2356, 0.0960))),
        (1.0, MoveTarget("orientation", (0.8460, 0.3230, -0.4232, -0.0309))),
    )
    quick = replace(scene("panda-hold", "avoidance.on=true"), events=drags)

    def fastest(margin: float) -> float:
        changes = (f"avoidance.velocity_margin={margin}",)
        found = run(replace(quick, settings=with_assignments(quick.settings, changes)), 1.8)
        assert not found["unsolved"].any()
        return float(np.abs(found["v"] / quick.robot.v_limit).max())

    assert fastest(0.08) < 1.0
    guarded(monkeypatch, never_faster)
    assert fastest(0.0) > 1.2


def test_kernel_and_printed_equations_keep_the_same_distances() -> None:
    """Near the floor, active rows of distances limit a level; both have the torques and bounds of the
    same problem."""
    quick = replace(scene("iiwa14-hold", "avoidance.on=true"), events=DOWN)
    leader = TorqueSession(quick)
    while not any(each.kind == "distance" for each in leader.binding()):
        leader.tick()
        assert leader.t < 3.0
    held = [each.joint for each in leader.binding() if each.kind == "distance"]
    assert all(" – " in joint for joint in held)
    for _ in range(20):
        leader.tick()
    given = leader.controller_input
    assert given is not None
    plans = []
    for name in ("himpc", "himpc_printed"):
        controller = TorqueSession(scene("iiwa14-hold", "avoidance.on=true", f"controller={name}")).controller
        controller.reset(leader.plant.tau)
        plans.append(controller.step(*given, leader.plant.tau).freeze())
    one, other = plans
    block = one.rows.constraints.index(DISTANCE)
    N = one.rows.L.shape[1]
    rows = slice(block * N, (block + 1) * N)
    assert np.isfinite(one.rows.lower[rows]).any()
    for plan_rows in ("lower", "upper"):
        assert getattr(one.rows, plan_rows)[rows] == pytest.approx(getattr(other.rows, plan_rows)[rows])
    first, second = one.rows.directions_of(rows.start), other.rows.directions_of(rows.start)
    assert first is not None
    assert second is not None
    assert first.names == second.names
    assert pytest.approx(second.D) == first.D
    assert one.unsolved == other.unsolved == 0
    assert one.tau == pytest.approx(other.tau, abs=1e-6)


def test_a_filter_behind_the_levels_is_listed_and_recorded() -> None:
    """When the filter is active, its pair has a name, and the row contains its leak into the levels and the
    bits of its bounds. The recorded distance is the nearest one of that pair."""
    session = TorqueSession(
        replace(
            scene("iiwa14-table", "avoidance.on=true", "controller=himpc_filtered"),
            events=((0.0, MoveTarget("position", (0.4, -0.4, 0.4))),),
        )
    )
    row = session.tick()
    fields = session.layout.fields
    assert np.isfinite(row[fields["distance"]]) and session.clearance.nearest.pair
    while not (found := [each for each in session.binding() if each.level == "filter"]):
        row = session.tick()
        assert session.t < 1.5
    assert [each.joint for each in found if each.kind == "distance"] == ["link_5 – post"]
    plan = session.plan
    assert plan is not None and plan.behind is not None
    bits = row[fields["at_bound"]].astype(int)
    assert (bits & 1 << CONSTRAINTS.index(DISTANCE)).any()
    assert row[fields["priority_leak"].start] == pytest.approx(plan.behind.solution.leak) != 0.0
    assert row[fields["tau_demand"]] == pytest.approx(plan.tau)
    assert row[fields["delta_tau"]] == pytest.approx(plan.tau - plan.tau_0)
    near = session.clearance.nearest
    assert near.kept == pytest.approx(0.02)
    assert near.kept < near.distance < 0.25


def test_distances_are_measured_where_there_is_something_to_measure() -> None:
    """With only a floor, distances are measured only if they are kept. Among objects they are always
    measured, but the bound is NaN if none is kept."""
    rows = [TorqueSession(each).tick().copy() for each in (
        scene("iiwa14-hold", OFF), scene("iiwa14-hold"), scene("iiwa14-table", OFF),
    )]  # fmt: skip
    fields = TorqueSession(scene("iiwa14-hold")).layout.fields
    known = [[np.isfinite(row[fields[name].start]) for name in ("distance", "distance_kept")] for row in rows]
    assert known == [[False, False], [True, True], [True, False]]


def test_a_scene_without_rows_of_distances_is_as_before() -> None:
    """If avoidance is switched off, neither d_safe nor another of its settings changes a bit of the run."""
    plain = run(scene("iiwa14-hold", OFF), 0.1)
    changed = run(scene("iiwa14-hold", OFF, "avoidance.d_safe=0.1", "avoidance.pull=0.01"), 0.1)
    assert np.array_equal(plain["tau"], changed["tau"])


def test_an_own_robot_gets_contacts_and_rows_from_its_urdf_alone(tmp_path: Path) -> None:
    """A generated arm, and a lamp without a collision shape, are dragged into their own foot. According to
    MuJoCo's geometry, they press on it without rows of distances, and touch nothing with them."""
    arm = tmp_path / "arm.urdf"
    arm.write_text(generated(3))
    drag = ((0.0, MoveTarget("position", (0.03, 0.0, 0.02))),)
    for urdf in (str(arm), "lessons/course/lamp.urdf"):
        deepest = []
        for on in ("false", "true"):
            found = torque_scene("hold", urdf=urdf)
            settings = with_assignments(found.settings, (f"avoidance.on={on}",))
            deepest.append(run(replace(found, settings=settings, events=drag), 2.0)["contact_depth"].max())
        assert deepest[0] > 0.0, urdf
        assert deepest[1] == 0.0, urdf
