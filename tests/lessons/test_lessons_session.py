"""Without a page, each tick of a session returns a row of telemetry that agrees with plant and plan."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from session_rows import value

from lessons.events import MoveTarget, Push, Set
from lessons.recording.run import run
from lessons.recording.summary import summary
from lessons.scenes.catalog import load_scene, prepared
from lessons.scenes.scene import TorqueScene
from lessons.session.start import begin
from lessons.session.torque import TorqueSession
from lessons.settings.assignments import with_assignments


def test_rows_tell_the_filtered_target(session: TorqueSession) -> None:
    """x_d and its derivatives in the row are those of the dragged target, and are consistent from tick to
    tick."""
    session.tick()
    start = value(session, session.tick(), "x_d/position").copy()
    goal = start + np.array([0.1, 0.05, -0.05])
    session.post(MoveTarget("position", tuple(goal)))
    rows = np.array([session.tick().copy() for _ in range(2500)])
    x_d, v_d, a_d = (rows[:, session.layout.fields[f"{name}/position"]] for name in ("x_d", "v_d", "a_d"))
    np.testing.assert_allclose(np.diff(x_d, axis=0), 0.5e-3 * (v_d[1:] + v_d[:-1]), atol=2e-9)
    np.testing.assert_allclose(np.diff(v_d, axis=0), 1e-3 * a_d[1:], atol=2e-8)
    np.testing.assert_allclose(x_d[-1], goal, atol=1e-6)
    np.testing.assert_allclose(rows[-1, session.layout.fields["x/position"]], goal, atol=1e-3)
    quaternion = rows[0, session.layout.fields["x_d/orientation"]]
    assert quaternion.shape == (4,)
    assert np.linalg.norm(quaternion) == pytest.approx(1)


def test_a_row_tells_the_truth(session: TorqueSession) -> None:
    """The applied torque, the true joint state, the bounds and both leaks in a row equal those of plant and
    plan."""
    for _ in range(5):
        session.tick()
    q, v = session.plant.q.copy(), session.plant.v.copy()
    row = session.tick()
    np.testing.assert_array_equal(value(session, row, "q"), q)
    np.testing.assert_array_equal(value(session, row, "v"), v)
    assert session.plan is not None
    np.testing.assert_array_equal(value(session, row, "tau_demand"), session.plan.tau)
    np.testing.assert_allclose(value(session, row, "tau"), session.plan.tau)
    np.testing.assert_allclose(value(session, row, "v_limit"), session.robot.v_limit)
    assert value(session, row, "priority_leak")[0] <= 1e-6
    assert value(session, row, "dynamic_leak")[0] >= 0
    assert value(session, row, "unsolved")[0] == 0
    assert value(session, row, "gauge_radius")[0] > 0


@pytest.mark.parametrize(
    ("name", "controller"), [("planar3-hold", "himpc"), ("planar3-hold", "hqp"), ("iiwa14-htmpc", "htmpc")]
)
def test_a_row_contains_the_figures_of_every_level(name: str, controller: str) -> None:
    """At torque level and at velocity level, a row contains the figures of every level of the plan, and the
    code of its fallback is the place of its name in the layout."""
    session = begin(prepared(load_scene(name), controller, ()))
    for _ in range(3):
        row = session.tick()
        assert session.plan is not None and session.plan.levels
        for level in session.plan.levels:
            fields = "cost", "kkt", "fallback", "time_us", "active"
            code = session.layout.fallbacks.index(level.fallback)
            figures = level.cost, level.kkt_residual, code, level.time_us, len(level.active)
            assert (
                tuple(row[session.layout.fields[f"{field}/{level.name}"]][0] for field in fields) == figures
            )


def test_the_gauge_follows_M_bar(session: TorqueSession) -> None:
    """The norm ‖I − M⁻¹M̄‖ in the row, which is 1 for M̄ = 0, increases if M̄ is ten times larger."""
    before = session.tick().copy()
    session.post(Set("M_bar_scale", 10))
    for _ in range(24):
        session.tick()
    row = session.tick()
    assert value(session, row, "gauge_norm")[0] > value(session, before, "gauge_norm")[0]


def test_losing_control_is_said(scene: TorqueScene) -> None:
    """A setting that cannot work ends the run with `diverged`, a notice, and a finite summary."""
    unlimited = ["limits.velocity=false", "limits.torque=false", "plant.saturate=false"]
    assignments = ["M_bar_scale=20", "R=0.01", *unlimited]
    push = Push(scene.robot.joint_names[3], force=(0.0, 20.0, 0.0))
    settings = with_assignments(scene.settings, assignments)
    recording = run(replace(scene, settings=settings, events=((0.01, push),)), duration=2.0)
    result = summary(recording)
    assert result["diverged"] is True
    assert result["diverged_at_s"] == pytest.approx(recording.session.diverged_at)
    assert "out of control" in recording.session.notices[-1]
    assert result["duration_s"] < 2.0
    json.dumps(result, allow_nan=False)
