"""In scenes with a world, a robot whose target is dragged touches the objects, and the summary reports the
contact force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lessons.events import MoveTarget, Set
from lessons.recording.run import run
from lessons.recording.summary import summary
from lessons.scenes.catalog import torque_scene
from lessons.scenes.names import SCENES
from lessons.scenes.scene import TorqueScene
from lessons.session.torque import TorqueSession
from lessons.settings.assignments import with_assignments

DRAGGED = [name for name in SCENES if "hold" in name or name.startswith("baxter") or name == "planar3-plane"]
PAPERS = [name for name in SCENES if name.endswith(("circle", "circle-paper", "conflict", "singular"))]


def load(name: str) -> TorqueScene:
    return torque_scene(name, urdf="iiwa14") if name == "hold" else torque_scene(name)


@pytest.mark.parametrize("name", DRAGGED)
def test_scenes_that_people_drag_in_have_contacts(name: str) -> None:
    """These scenes run with contacts and begin without one. Their world is a floor, except for the planar
    robot."""
    scene = load(name)
    assert scene.settings.plant.contacts
    assert scene.settings.plant.joint_stops
    assert [thing.shape.name for thing in scene.world] == ([] if "planar3" in name else ["floor"])
    found = run(scene, 0.05)
    assert found.session.diverged_at is None
    assert summary(found)["contact"] == {"max_depth_m": 0.0, "max_force_N": 0.0, "time_s": 0.0}


@pytest.mark.parametrize("name", [name for name in PAPERS if not name.startswith("baxter")])
def test_the_papers_scenes_have_none(name: str) -> None:
    """The scenes of the papers have no contacts, because the papers' numbers are those of a robot without
    geometry."""
    scene = load(name)
    assert not scene.settings.plant.contacts
    assert not scene.settings.plant.joint_stops
    assert scene.world == ()


DOWN = ((0.0, MoveTarget("position", (0.55, 0.1, -0.15))),)


def test_a_hand_that_is_dragged_into_the_floor_presses_on_it() -> None:
    """With contacts the hand stays above the floor, and the summary states depth, force and duration. Without
    contacts it passes through the floor."""
    scene = load("panda-hold")
    blind = with_assignments(scene.settings, ["avoidance.on=false"])
    scene = replace(scene, settings=blind, events=DOWN)
    pressing = run(scene, 2.0, to_the_end=True)
    bare = replace(scene.settings, plant=replace(scene.settings.plant, contacts=False))
    through = run(replace(scene, settings=bare), 2.0, to_the_end=True)
    told = summary(pressing)["contact"]
    assert 0.0 < told["max_depth_m"] < 3e-3
    assert told["max_force_N"] == pressing["contact_force"].max()
    assert pressing["contact_force"][-300:].mean() > 20.0  # a peak depends on the plant's time step
    assert 0.1 < told["time_s"] < 2.0
    assert summary(through)["contact"] == {"max_depth_m": 0.0, "max_force_N": 0.0, "time_s": 0.0}
    lowest = [found["x/position"][:, 2].min() for found in (pressing, through)]
    assert lowest[0] > -5e-3
    assert lowest[1] < -0.1
    touching = pressing["contact_force"][:, 0] > 0.0
    first = int(np.argmax(touching))
    # Until the first contact the two runs are equal to the last bit.
    np.testing.assert_array_equal(pressing["q"][: first + 1], through["q"][: first + 1])


def test_contacts_are_switched_live() -> None:
    session = TorqueSession(load("panda-hold"))
    session.tick()
    session.post(Set("plant.contacts", False))
    session.tick()
    assert not session.plant.settings.contacts
    session.post(Set("plant.contacts", "perhaps"))
    session.tick()
    (notice,) = session.notices
    assert "plant.contacts" in notice
    assert not session.plant.settings.contacts
