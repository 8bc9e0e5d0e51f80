"""Events are data in a mailbox. At their tick they take effect, or are refused in one sentence."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from session_rows import value

from lessons.events import Event, MoveLevel, MoveTarget, Push, Reset, Set, as_data, from_data
from lessons.scenes.catalog import torque_scene
from lessons.scenes.scene import TorqueScene
from lessons.session.torque import TorqueSession
from robots import InputError, NominalSettings

EVENTS: list[Event] = [
    Set("horizon", 8),
    Set("levels.position.Q", (1.0, 2.0, 3.0)),
    MoveLevel("posture", 0),
    MoveTarget("position", (0.1, 0.2, 0.3)),
    Push("joint_4", torque=(1.0, 0.0, 0.0), seconds=0.2),
    Reset(),
]


@pytest.mark.parametrize("event", EVENTS, ids=lambda event: type(event).__name__)
def test_events_survive_json(event: Event) -> None:
    """An event that was stored as JSON is equal to the original."""
    assert from_data(json.loads(json.dumps(as_data(event)))) == event


@pytest.mark.parametrize("data", [{}, {"event": "Explode"}, {"event": "Set"}, {"event": "Reset", "when": 3}])
def test_what_is_no_event_is_refused(data: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="not an event"):
        from_data(data)


def test_an_event_waits_for_the_next_tick(session: TorqueSession) -> None:
    """Nothing changes before the tick that reads the mailbox; then the log contains the event with its
    time."""
    session.tick()
    session.post(Set("horizon", 8))
    assert session.settings.horizon == 5
    session.tick()
    assert session.settings.horizon == 8
    assert session.plan is not None
    assert session.plan.q.shape == (9, 7)
    assert session.log == [(pytest.approx(1e-3), Set("horizon", 8))]


def test_names_stay_when_the_order_changes(session: TorqueSession) -> None:
    """Levels and tasks are identified by name in every order."""
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
def test_a_refused_event_leaves_a_notice_and_changes_nothing(scene: TorqueScene, event: Event) -> None:
    """The learner reads one sentence. Settings, plant and motion are the same as without the event."""
    session, quiet = TorqueSession(scene), TorqueSession(scene)
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


NOMINAL = NominalSettings(armature=(0.1, 0.2))
"""It does not fit the robot. M_bar_adapt uses it."""


@pytest.mark.parametrize("controller", ["himpc", "hqp"])
def test_settings_of_which_one_is_refused_change_neither_controller_nor_plant(
    scene: TorqueScene, controller: str
) -> None:
    """`adopt` gets several changes at once: the controller refuses one of them, then the plant. In both cases
    controller and plant keep the settings of the session."""
    session, quiet = TorqueSession(scene), TorqueSession(scene)
    now, plant = session.settings, session.settings.plant
    heavy = replace(now, controller=controller, M_bar_adapt=True, horizon=9)
    for wrong in (
        replace(heavy, nominal=NOMINAL, plant=replace(plant, payload_kg=5.0)),
        replace(heavy, plant=replace(plant, payload_kg=5.0, friction=(0.1, 0.2))),
    ):
        with pytest.raises(InputError):
            session.adopt(wrong)
        assert session.settings == now
        assert session.plant.settings == plant
        assert session.controller.settings == now.for_controller()
    rows, others = (np.array([each.tick().copy() for _ in range(5)]) for each in (session, quiet))
    np.testing.assert_array_equal(value(session, rows, "tau"), value(quiet, others, "tau"))


def test_a_fixed_motion_cannot_be_dragged() -> None:
    session = TorqueSession(torque_scene("iiwa14-circle"))
    session.post(MoveTarget("position", (0.0, 0.0, 0.0)))
    session.tick()
    assert "fixed motion" in session.notices[0]


def test_reset_goes_back_to_the_start_and_keeps_the_settings(session: TorqueSession) -> None:
    """After a reset the first rows are repeated, with the present settings."""
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


def test_a_push_ends(session: TorqueSession) -> None:
    """The force acts for its duration and then ends."""
    session.tick()
    session.post(Push(session.robot.joint_names[3], force=(0.0, 20.0, 0.0), seconds=0.05))
    speeds = [np.abs(value(session, session.tick(), "v")).max() for _ in range(1500)]
    assert max(speeds[:60]) > 0.01
    assert speeds[-1] < 0.1 * max(speeds)


def test_pushes_of_two_lengths_do_not_add_up(session: TorqueSession) -> None:
    """A new push replaces the previous push and its duration."""
    session.tick()
    session.post(Push(session.robot.joint_names[3], force=(0.0, 5.0, 0.0), seconds=10.0))
    session.tick()
    session.post(Push(session.robot.joint_names[5], force=(0.0, 1.0, 0.0), seconds=0.002))
    for _ in range(5):
        session.tick()
    idle = session.plant.acceleration(session.plant.tau)
    session.plant.push(None)
    np.testing.assert_allclose(session.plant.acceleration(session.plant.tau), idle, atol=1e-12)


def test_scripted_events_come_in_their_time(scene: TorqueScene) -> None:
    """The events of a scene take effect at the tick of their time, also after a reset."""
    scripted = replace(scene, events=((0.005, Set("horizon", 2)), (0.01, Set("horizon", 3))))
    session = TorqueSession(scripted)
    horizons = []
    for _ in range(15):
        session.tick()
        horizons.append(session.settings.horizon)
    assert horizons == [5] * 5 + [2] * 5 + [3] * 5
    session.post(Reset())
    for _ in range(7):
        session.tick()
    assert session.settings.horizon == 2
