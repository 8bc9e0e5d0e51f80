"""Contacts on the page: reported, drawn as arrows, and marked in the plot of errors."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.link.choice import SceneChoice
from app.link.messages import ContactPoint, Post
from app.panels.run.plots import touching
from app.view.robot import CoverView
from app.view.surroundings import ContactView, WorldView
from app.worker.simulation import SimulationRunner
from lessons.events import MoveTarget
from lessons.scenes.run_spec import AS_PRINTED, RunSpec
from robots import Ball, Box, Floor, load_robot
from robots.covering.cover_of import cover_of
from robots.shapes.capsules import cover_parts
from robots.world import Post as Pole
from robots.world import Thing


def test_the_simulation_reports_what_the_robot_touches() -> None:
    """A hand is dragged into the floor; the status reports the contact, with a force that pushes the hand
    upwards."""
    body = SimulationRunner(SceneChoice(RunSpec("panda-hold").but(*AS_PRINTED)))
    try:
        assert [thing.shape.name for thing in body.ready().world] == ["floor"]
        assert body.status().contacts == ()
        body.handle(Post(MoveTarget("position", (0.55, 0.1, -0.15))))
        for _ in range(3000):
            body.tick()
            if body.session.plant.contacts:  # pyright: ignore[reportAttributeAccessIssue]
                break
        contacts = body.status().contacts
        assert {contact.between for contact in contacts} == {("floor", "hand")}
        assert sum(contact.force[2] for contact in contacts) > 0.0
        assert body.status().objects.shape == (0, 7)
    finally:
        body.close()


class Scene:
    """Records what is added to the 3D view."""

    def __init__(self) -> None:
        self.added: dict[str, Any] = {}

    def __getattr__(self, name: str) -> Any:
        def add(node: str, *given: Any, **named: Any) -> Any:
            still = {"position": np.zeros(3), "wxyz": np.array([1.0, 0.0, 0.0, 0.0])}
            handle = SimpleNamespace(kind=name, given=given, **(still | named))
            self.added[node] = handle
            return handle

        return add


def test_contacts_are_arrows_and_the_strongest_has_a_label() -> None:
    scene: Any = Scene()
    view = ContactView(scene)
    arrows, label = scene.added["/contacts"], scene.added["/contact_label"]
    assert not arrows.visible
    weak = ContactPoint(("link1", "hand"), (0.0, 0.0, 1.0), (0.0, 5.0, 0.0))
    strong = ContactPoint(("floor", "hand"), (0.5, 0.0, 0.0), (0.0, 0.0, 200.0))
    view.show((weak, strong, strong))
    assert arrows.visible
    np.testing.assert_allclose(arrows.points[1], [(0.5, 0.0, 0.0), (0.5, 0.0, 0.2)], atol=1e-6)
    assert np.linalg.norm(arrows.points[0, 1] - arrows.points[0, 0]) == pytest.approx(0.02)
    assert label.text == "hand – floor: 400 N"
    view.show(())
    assert not arrows.visible
    assert not label.visible


def test_the_objects_of_a_scene_are_drawn_and_free_ones_move() -> None:
    scene: Any = Scene()
    world = (
        Thing(Floor()),
        Thing(Box("box", (1.0, 0.0, 0.5), (0.1, 0.2, 0.3))),
        Thing(Pole("post", (0.0, 1.0, 0.0), 1.0, 0.05)),
        Thing(Ball("ball", (0.0, 0.0, 1.0), 0.1), mass_kg=1.0),
    )
    view = WorldView(scene, world)
    kinds = {node: handle.kind for node, handle in scene.added.items()}
    assert kinds == {"/world/1": "add_box", "/world/2": "add_cylinder", "/world/3": "add_icosphere"}
    np.testing.assert_allclose(scene.added["/world/2"].position, [0.0, 1.0, 0.5])
    view.follow(np.array([[0.3, 0.2, 0.1, 1.0, 0.0, 0.0, 0.0]]))
    np.testing.assert_allclose(scene.added["/world/3"].position, [0.3, 0.2, 0.1])


def test_the_plot_of_errors_marks_the_time_in_contact() -> None:
    window: Any = SimpleNamespace(
        layout=SimpleNamespace(fields={"contact_force": 0}),
        columns=lambda _: np.array([[np.nan], [0.0], [12.0], [0.0]]),
    )
    np.testing.assert_array_equal(touching(window) > 0.0, [False, False, True, False])


def test_the_cover_is_drawn_on_request() -> None:
    """The meshes are created at the first request. Each mesh is a child of the frame of its body, and
    contains the body's drawn shapes."""
    scene: Any = Scene()
    robot = load_robot("panda")
    view = CoverView(scene, robot)
    view.draw(False)
    assert not scene.added
    view.draw(True)
    bodies = {capsule.joint for capsule in cover_of(robot).capsules}
    assert set(scene.added) == {f"/robot/{joint or 'base'}/cover" for joint in bodies}
    assert all(node.visible for node in scene.added.values())
    for part in cover_parts(cover_of(robot)):
        for capsule in (each for each in cover_of(robot).capsules if each.joint == part.joint):
            ends = np.array([capsule.start, capsule.end])
            assert (part.vertices.min(axis=0) <= ends.min(axis=0) - 0.97 * capsule.radius).all()
            assert (part.vertices.max(axis=0) >= ends.max(axis=0) + 0.97 * capsule.radius).all()
    view.draw(False)
    assert not any(node.visible for node in scene.added.values())
