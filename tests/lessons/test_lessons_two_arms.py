"""The hands of the robot with two arms keep their relative pose for all tasks of lower levels."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from lessons.events import MoveTarget, Set
from lessons.recording.run import run
from lessons.recording.summary import summary
from lessons.scenes.catalog import torque_scene
from lessons.scenes.two_arms import EDGE_S, SIDE, START_S
from lessons.session.torque import TorqueSession


def test_the_hands_move_along_a_square_as_if_they_carried_a_tray() -> None:
    """The relative pose of the hands changes by less than 0.5 mm and 0.2°. The middle reaches every corner
    and stays level."""
    recording = run(torque_scene("baxter-tray"))
    assert np.abs(recording["error/grip"]).max() < 0.5e-3
    assert np.degrees(np.linalg.norm(recording["error/grip_turn"], axis=1).max()) < 0.2
    assert np.degrees(np.abs(recording["error/level"]).max()) < 0.2
    start, tray = recording["x/tray"][0], recording["x/tray"]
    for place, corner in enumerate([(0, 0, 1), (0, 1, 1), (0, 1, 0), (0, 0, 0)], start=1):
        after = recording["t"][:, 0].searchsorted(START_S + place * EDGE_S)
        there = np.linalg.norm(tray[after : after + 300] - start - SIDE * np.array(corner), axis=1).min()
        assert there < 4e-3
    found = summary(recording)
    assert found["solver"]["unsolved"] == 0
    assert [(each["rank"], each["rows"]) for each in found["levels"]] == [(6, 6), (5, 5), (3, 14)]


def test_nothing_but_level_1_keeps_the_hands_together() -> None:
    """The scene has no tray: the plant has no additional mass, and without the task `grip` the hands
    separate."""
    session = TorqueSession(torque_scene("baxter-tray"))
    M = pin.crba(session.robot.model, session.robot.model.createData(), session.plant.q)
    M = np.triu(M) + np.triu(M, 1).T + 0.1 * np.eye(14)
    np.testing.assert_allclose(session.plant.mass_matrix(), M, atol=1e-9)
    session.post(Set("levels.1.enabled", False))
    row = [session.tick() for _ in range(1500)][-1]
    assert np.linalg.norm(row[session.layout.fields["error/grip"]]) > 0.1


def test_both_hands_are_dragged_apart_from_each_other() -> None:
    session = TorqueSession(torque_scene("baxter-hold"))
    goals = {}
    for name, step in (("right", (0.05, -0.08, 0.05)), ("left", (0.0, 0.08, -0.06))):
        target = session.target(name)
        assert target is not None
        goals[name] = target.raw + np.array(step)
        session.post(MoveTarget(name, tuple(goals[name])))
    row = [session.tick() for _ in range(1800)][-1]
    for name, goal in goals.items():
        assert np.linalg.norm(row[session.layout.fields[f"x/{name}"]] - goal) < 1e-3
        assert np.degrees(np.abs(row[session.layout.fields[f"error/{name}_turn"]]).max()) < 0.2
    assert session.diverged_at is None


@pytest.mark.parametrize("swapped", [False, True])
def test_who_ranks_higher_gets_its_hand(swapped: bool) -> None:
    """The grip is on level 1, and the targets of the two hands are 15 cm too far apart. Of the two hands, the
    one on the higher level reaches its target and the other follows; if the levels are swapped, so are the
    hands."""
    session = TorqueSession(torque_scene("baxter-conflict"))
    if swapped:
        session.post(Set("order", "grip+grip_turn,left,right,posture"))
    row = [session.tick() for _ in range(2500)][-1]
    fields = session.layout.fields
    far = {name: np.linalg.norm(row[fields[f"error/{name}"]]) for name in ("right", "left", "grip")}
    winner, loser = ("left", "right") if swapped else ("right", "left")
    assert far["grip"] < 0.5e-3
    assert far[winner] < 1e-3
    assert far[loser] == pytest.approx(0.15, abs=2e-3)
