"""The headless session: a mailbox of events, a truthful row per tick, and files that reproduce a run."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lessons.events import Event, MoveLevel, MoveTarget, Push, Reset, Set, as_data, from_data
from lessons.run import run, with_assignments
from lessons.scene import Scene
from lessons.scenes import SCENES, load_scene
from lessons.session import Session
from lessons.summary import arrays, summary
from robots import InputError

EVENTS: list[Event] = [
    Set("horizon", 8),
    Set("levels.position.Q", (1.0, 2.0, 3.0)),
    MoveLevel("posture", 0),
    MoveTarget("position", (0.1, 0.2, 0.3)),
    Push("joint_4", torque=(1.0, 0.0, 0.0), seconds=0.2),
    Reset(),
]


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene("iiwa14-hold")


@pytest.fixture
def session(scene: Scene) -> Session:
    return Session(scene)


def value(session: Session, row: np.ndarray, name: str) -> np.ndarray:
    return row[session.layout.fields[name]]


@pytest.mark.parametrize("event", EVENTS, ids=lambda event: type(event).__name__)
def test_events_survive_json(event: Event) -> None:
    """An event is data: what a recording stores is what happened."""
    assert from_data(json.loads(json.dumps(as_data(event)))) == event


@pytest.mark.parametrize("data", [{}, {"event": "Explode"}, {"event": "Set"}, {"event": "Reset", "when": 3}])
def test_what_is_no_event_is_refused(data: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="no event"):
        from_data(data)


def test_an_event_waits_for_the_next_tick(session: Session) -> None:
    """Nothing changes until the tick that drains the mailbox; then it is in the log with its time."""
    session.tick()
    session.post(Set("horizon", 8))
    assert session.settings.horizon == 5
    session.tick()
    assert session.settings.horizon == 8
    assert session.plan is not None
    assert session.plan.q.shape == (9, 7)
    assert session.log == [(pytest.approx(1e-3), Set("horizon", 8))]


def test_names_stay_when_the_order_changes(session: Session) -> None:
    """Levels and tasks are told by name, wherever they stand."""
    session.post(MoveLevel("posture", 0))
    session.post(Set("levels.position.Q", 7))
    session.post(Set("tasks.orientation.K_p", 33))
    session.tick()
    levels = session.settings.levels
    assert [level.name for level in levels] == ["posture", "position", "orientation"]
    assert levels[1].Q == 7.0
    assert levels[2].tasks[0].K_p == 33.0
    assert session.plan is not None
    assert session.plan.levels[0].name == "posture"


REFUSED: list[Event] = [
    Set("horizn", 8),
    Set("horizon", 0),
    Set("M_bar", [0.1, 0.1]),
    Set("levels.1.Q", [1.0, 2.0]),
    Set("levels.1.R", [1.0, 2.0]),
    Set("levels.2.K_p", [1.0, 2.0]),
    Set("plant.payload_kg", -1),
    Set("plant.friction", [1.0, 2.0]),
    MoveLevel("nothing", 0),
    MoveLevel("posture", 3),
    MoveTarget("nothing", (0.0, 0.0, 0.0)),
    MoveTarget("position", (0.0, float("nan"), 0.0)),
    MoveTarget("position", (0.0, 0.0)),
    MoveTarget("orientation", (0.0, 0.0, 0.0)),
    MoveTarget("orientation", (0.0, 0.0, 0.0, 0.0)),
    MoveTarget("posture", (0.0, 0.0)),
    Push("nowhere", torque=(1.0, 0.0, 0.0)),
    Push("joint_4", torque=(1.0, 0.0, 0.0), seconds=-1.0),
    Push("joint_4", force=(float("nan"), 0.0, 0.0)),
]


@pytest.mark.parametrize("event", REFUSED, ids=str)
def test_a_refused_event_leaves_a_notice_and_changes_nothing(scene: Scene, event: Event) -> None:
    """The learner reads one sentence; settings, plant and the motion are as if it had not been."""
    session, quiet = Session(scene), Session(scene)
    session.tick()
    quiet.tick()
    session.post(event)
    rows, others = (np.array([each.tick().copy() for _ in range(3)]) for each in (session, quiet))
    assert len(session.notices) == 1
    assert "\n" not in session.notices[0]
    assert session.log == []
    assert session.settings == quiet.settings
    assert session.plant.settings == quiet.plant.settings
    np.testing.assert_array_equal(value(session, rows[-1], "tau"), value(quiet, others[-1], "tau"))


def test_a_fixed_motion_cannot_be_dragged() -> None:
    session = Session(load_scene("iiwa14-circle"))
    session.post(MoveTarget("position", (0.0, 0.0, 0.0)))
    session.tick()
    assert "fixed motion" in session.notices[0]


def test_reset_goes_back_to_the_start_and_keeps_the_settings(session: Session) -> None:
    """The same first rows again, under the settings of now."""
    session.post(Set("horizon", 3))
    first = session.tick().copy()
    session.post(MoveTarget("position", (0.5, 0.3, 0.5)))
    session.post(Push(session.robot.joint_names[3], force=(30.0, 0.0, 0.0), seconds=5.0))
    for _ in range(300):
        session.tick()
    assert np.abs(session.plant.q - session.robot.home).max() > 1e-3
    session.post(Reset())
    again = session.tick().copy()
    assert session.settings.horizon == 3
    assert session.t == pytest.approx(1e-3)
    for name in ("t", "q", "v", "tau", "x_d/position", "error/position"):
        np.testing.assert_array_equal(value(session, again, name), value(session, first, name))
    for _ in range(200):
        session.tick()
    np.testing.assert_allclose(session.plant.q, session.robot.home, atol=1e-4)


def test_a_push_ends(session: Session) -> None:
    """The force acts for its time and no longer."""
    session.tick()
    session.post(Push(session.robot.joint_names[3], force=(0.0, 20.0, 0.0), seconds=0.05))
    speeds = [np.abs(value(session, session.tick(), "v")).max() for _ in range(1500)]
    assert max(speeds[:60]) > 0.01
    assert speeds[-1] < 0.1 * max(speeds)


def test_pushes_of_two_lengths_do_not_add_up(session: Session) -> None:
    """A new push replaces the one before, its end included."""
    session.tick()
    session.post(Push(session.robot.joint_names[3], force=(0.0, 5.0, 0.0), seconds=10.0))
    session.tick()
    session.post(Push(session.robot.joint_names[5], force=(0.0, 1.0, 0.0), seconds=0.002))
    for _ in range(5):
        session.tick()
    idle = session.plant.acceleration(session.plant.tau)
    session.plant.push(None)
    np.testing.assert_allclose(session.plant.acceleration(session.plant.tau), idle, atol=1e-12)


def test_rows_tell_the_filtered_target(session: Session) -> None:
    """x_d and its derivatives in the row are those of the dragged target, and fit together over ticks."""
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


def test_a_row_tells_the_truth(session: Session) -> None:
    """Torque applied, true joint state, bounds and both leaks are what plant and plan say."""
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


def test_the_gauge_follows_M_bar(session: Session) -> None:
    """With M̄ = 0 nearly, ‖I − M⁻¹M̄‖ is 1; a ten times larger M̄ shows at once in both numbers."""
    before = session.tick().copy()
    session.post(Set("M_bar_scale", 10))
    for _ in range(24):
        session.tick()
    row = session.tick()
    assert value(session, row, "gauge_norm")[0] > value(session, before, "gauge_norm")[0]


def test_scripted_events_come_in_their_time(scene: Scene) -> None:
    """A scene's own events take effect at the tick of their time, and again after a reset."""
    scripted = replace(scene, events=((0.005, Set("horizon", 2)), (0.01, Set("horizon", 3))))
    session = Session(scripted)
    horizons = []
    for _ in range(15):
        session.tick()
        horizons.append(session.settings.horizon)
    assert horizons == [5] * 5 + [2] * 5 + [3] * 5
    session.post(Reset())
    for _ in range(7):
        session.tick()
    assert session.settings.horizon == 2


def test_losing_control_is_said(scene: Scene) -> None:
    """A hopeless setting ends a run honestly: diverged, a notice, and a finite summary."""
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


# ------------------------------------------------------------------ files


@pytest.fixture(scope="module")
def recorded(scene: Scene) -> dict[str, Any]:
    settings = with_assignments(scene.settings, ["horizon=3", "plant.payload_kg=1"])
    events = ((0.02, MoveTarget("position", (0.5, 0.1, 0.6))), (0.05, Set("levels.posture.enabled", False)))
    recording = run(replace(scene, settings=settings, events=events), duration=0.2, seed=5)
    return arrays(recording, {"scene": "iiwa14-hold", "seed": 5, "set": ["horizon=3", "plant.payload_kg=1"]})


def test_npz_holds_a_row_per_tick(recorded: dict[str, Any]) -> None:
    """Times, joints, references and errors of every task, with names to read them by."""
    assert recorded["t"].shape == (200,)
    np.testing.assert_allclose(np.diff(recorded["t"]), 1e-3)
    for name in ("q", "v", "tau", "tau_demand", "tau_lower", "tau_upper", "v_limit", "q_lower", "q_upper"):
        assert recorded[name].shape == (200, 7)
        assert np.isfinite(recorded[name]).all()
    assert recorded["x_d/orientation"].shape == (200, 4)
    assert recorded["error/position"].shape == (200, 3)
    assert int(recorded["level/orientation"]) == 2
    assert len(recorded["joint_names"]) == 7
    np.testing.assert_allclose(
        recorded["error/position"], recorded["x/position"] - recorded["x_d/position"], atol=1e-12
    )


def test_the_settings_beside_it_reproduce_the_run(recorded: dict[str, Any]) -> None:
    """Scene, settings, seed and timestamped events give the same torques to the bit."""
    how = json.loads(str(recorded["settings"]))
    assert [event["event"] for event in how["events"]] == ["MoveTarget", "Set"]
    assert how["in_force"]["horizon"] == 3
    scene = load_scene(how["scene"])
    events = tuple((event.pop("t"), from_data(event)) for event in how["events"])
    settings = with_assignments(scene.settings, how["set"])
    again = arrays(run(replace(scene, settings=settings, events=events), duration=0.2, seed=how["seed"]), {})
    for name in ("t", "q", "tau", "x_d/position", "error/orientation"):
        np.testing.assert_array_equal(again[name], recorded[name])


def test_every_scene_loads_and_ticks() -> None:
    """The list is what there is; 'hold' takes any robot, also a catalog name."""
    for name in SCENES:
        session = Session(load_scene(name, "planar3" if name == "hold" else None))
        session.tick()
        assert session.plan is not None
        assert np.isfinite(session.plan.tau).all()


@pytest.mark.parametrize(
    ("name", "urdf", "tip"),
    [
        ("iiwa14-hodl", None, None),
        ("hold", None, None),
        ("iiwa14-hold", "planar3", None),
        ("iiwa14-circle", None, "flange"),
        ("hold", "planar4", None),
        ("hold", "planar3", "nose"),
        ("hold", "/nowhere/arm.urdf", None),
    ],
)
def test_scenes_that_cannot_be(name: str, urdf: str | None, tip: str | None) -> None:
    with pytest.raises(InputError) as error:
        load_scene(name, urdf, tip)
    assert "\n" not in str(error.value)


def test_a_run_needs_a_length(scene: Scene) -> None:
    for seconds in (0.0, -1.0, float("nan"), 1e9):
        with pytest.raises(InputError, match="duration"):
            run(scene, seconds)
