"""Settings may change while the robot of a session moves."""

from __future__ import annotations

import numpy as np
import pytest
from session_rows import field, rows_of

from himpc.constants import AT_TORQUE
from lessons.events import Event, MoveLevel, MoveTarget, Set
from lessons.scenes.catalog import torque_scene
from lessons.scenes.scene import TorqueScene
from lessons.session.torque import TorqueSession


def change_events(scene: TorqueScene) -> dict[str, list[Event]]:
    """Returns every setting that a learner can change, each as events for a session at its start."""
    names = [level.name for level in scene.settings.levels]
    M_bar = [1.5 * m for m in scene.settings.M_bar]
    singles = {
        "horizon=1": Set("horizon", 1),
        "horizon=12": Set("horizon", 12),
        "M_bar_scale=0.5": Set("M_bar_scale", 0.5),
        "M_bar_scale=2": Set("M_bar_scale", 2),
        "M_bar_adapt": Set("M_bar_adapt", True),
        "M_bar": Set("M_bar", M_bar),
        "Q": Set("Q", 2000),
        "R": Set("R", 0.5),
        "R of level 2": Set("levels.2.R", 300),
        "T_s=0.002": Set("T_s", 0.002),
        "T_s=0.0005": Set("T_s", 0.0005),
        "K_p": Set("levels.1.K_p", 200),
        "K_v": Set("levels.2.K_v", 25),
        "torque_scale": Set("limits.torque_scale", 0.8),
        "velocity_scale": Set("limits.velocity_scale", 0.1),
        "position=paper": Set("limits.position", "paper"),
        "position=off": Set("limits.position", "off"),
        "no velocity limits": Set("limits.velocity", False),
        "no torque limits": Set("limits.torque", False),
        "printed": Set("controller", "himpc_printed"),
        "R_on": Set("R_on", "acceleration"),
        "no damping": Set("damping", False),
        "level horizon": Set("levels.2.horizon", 1),
    }
    changes: dict[str, list[Event]] = {name: [event] for name, event in singles.items()}
    changes["proxqp"] = [Set("controller", "himpc_printed"), Set("solver", "proxqp")]
    for name in names:
        changes[f"{name} off and on"] = [Set(f"levels.{name}.enabled", on) for on in (False, True)]
    changes["last level first"] = [MoveLevel(names[-1], 0)]
    changes["first level last"] = [MoveLevel(names[0], len(names) - 1)]
    return changes


CASES = [
    (name, change) for name in ("iiwa14-hold", "planar3-hold") for change in change_events(torque_scene(name))
]


@pytest.mark.parametrize(("name", "change"), CASES)
def test_changes_at_rest_are_bumpless(name: str, change: str) -> None:
    """If all targets are reached, a change of a setting changes no torque by 5 % of its limit and moves the
    tip by less than 1 mm."""
    scene = torque_scene(name)
    session = TorqueSession(scene)
    rows_of(session, 20)
    tau, start = session.plant.tau.copy(), session.plant.frame_pose(session.robot.tip)[1].copy()
    events = change_events(scene)[change]
    torque, moved = 0.0, 0.0
    for event in events:
        session.post(event)
        for _ in range(500 // len(events)):
            row = session.tick()
            step = np.abs(row[session.layout.fields["tau_demand"]] - tau) / session.robot.tau_limit
            torque = max(torque, float(step.max()))
            tip = session.plant.frame_pose(session.robot.tip)[1]
            moved = max(moved, float(np.linalg.norm(tip - start)))
    assert not session.notices
    assert len(session.log) == len(events)
    assert torque < 0.05
    assert moved < 1e-3


def test_a_level_enabled_with_a_large_error_fades_in(scene: TorqueScene) -> None:
    """The weight Q of a level that is enabled increases for half a second. The torques change little at
    first, and the task reaches its target."""
    session = TorqueSession(scene)
    session.post(Set("levels.orientation.enabled", False))
    session.post(Set("levels.posture.enabled", False))
    session.tick()
    session.post(MoveTarget("orientation", (0.3, 0.8, 0.0, 0.4)))
    rows_of(session, 1500)
    before = session.plant.tau.copy()
    session.post(Set("levels.orientation.enabled", True))
    rows = rows_of(session, 20)
    assert (np.abs(field(session, rows, "tau_demand") - before) / session.robot.tau_limit).max() < 0.05
    rows = rows_of(session, 3000)
    assert np.abs(field(session, rows, "error/orientation")[-1]).max() < 0.05
    assert np.abs(field(session, rows, "error/position")).max() < 1e-2


def test_a_torque_limit_tightened_below_the_present_torque_closes_in(scene: TorqueScene) -> None:
    """The bound starts at the present torque and decreases without a step, and the demanded torque stays
    within it."""
    session = TorqueSession(scene)
    rows_of(session, 20)
    present = np.abs(session.plant.tau / session.robot.tau_limit).max()
    assert present > 0.05
    session.post(Set("limits.torque_scale", float(0.8 * present)))
    rows = rows_of(session, 1500)
    lower, upper = field(session, rows, "tau_lower"), field(session, rows, "tau_upper")
    demand = field(session, rows, "tau_demand")
    limit = session.robot.tau_limit
    assert ((demand <= upper) & (demand >= lower)).all()
    for bound in (lower, upper):
        assert (np.abs(np.diff(bound, axis=0)) / limit).max() < 0.01
    assert (np.maximum(upper, -lower)[0] / limit).max() > 0.97 * present
    np.testing.assert_allclose(upper[-1], 0.8 * present * limit)
    assert (field(session, rows, "at_bound").astype(int)[-1] & AT_TORQUE).any()
    assert np.isfinite(rows[:, session.layout.fields["q"]]).all()
