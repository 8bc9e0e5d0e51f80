"""What the 3D view draws of robots, contacts and objects."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest

from app.link.choice import SceneChoice
from app.link.messages import ContactPoint, Post
from app.link.poses import LinkPoses
from app.panels.run.plots import touching
from app.tab.context import PageContext
from app.view.robot import CoverView, JointTurns
from app.view.surroundings import ContactView, Ground, WorldView
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


@pytest.mark.parametrize("name", ["iiwa14", "ridgeback-ur10", "planar3"])
def test_the_shadow_lies_on_the_floor_below_the_arm(name: str) -> None:
    """The discs lie below the arm, from its first joint to its tip; a disc below a higher point is larger and
    fainter; for a robot at rest nothing is sent."""
    scene, robot = Scene(), load_robot(name)
    ground = Ground(scene, robot, np.empty((0, 3)))  # pyright: ignore[reportArgumentType]
    shadow, links = scene.added["/shadow"], LinkPoses(robot)
    poses = links.at(robot.home)
    assert poses is not None
    ground.move(poses)
    at = np.array(shadow.batched_positions)
    assert (at[:, 2] > 0.0).all() and (at[:, 2] < 0.03).all()
    for joint in poses[:-1]:
        assert np.hypot(*(at[:, :2] - joint[:2]).T).min() < 0.01
    assert np.hypot(*(at[:, :2] - poses[-1, :2]).T).min() < 0.4 * max(0.1, np.ptp(poses[:, :3]))
    size, dark = np.array(shadow.batched_scales), np.array(shadow.batched_opacities)
    one_ring = len(size) // 2
    assert (np.diff(dark[np.argsort(size[:one_ring])]) <= 1e-6).all()
    shadow.batched_positions = None
    ground.move(poses + 1e-4)
    assert shadow.batched_positions is None


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


def recording(*rows: tuple[float, float, float]) -> Any:
    """Returns a window with rows of t, q_1 and q_2."""
    values = np.array(rows)
    layout = SimpleNamespace(fields={"t": slice(0, 1), "q": slice(1, 3)})
    return SimpleNamespace(layout=layout, columns=lambda span: values[:, span])


def test_the_turn_since_the_start_is_at_each_joint() -> None:
    """Also if the page saw no picture of the start, as in a run that is as fast as possible."""
    scene = MagicMock()
    labels = scene.add_label.side_effect = [MagicMock(visible=False, text="") for _ in range(2)]
    turns, q, poses = JointTurns(scene, (1, 2)), np.array([0.5, -1.0]), np.arange(21.0).reshape(3, 7)
    unknown, nothing = np.full(2, np.nan), recording((np.nan, np.nan, np.nan))
    turns.draw(0.0, unknown, poses, nothing)
    turns.draw(3.0, q, poses, recording((2.0, *q), (3.0, *q)))
    assert not any(label.visible for label in labels), "a page that opens late does not know the start"
    whole = recording((np.nan, np.nan, np.nan), (0.001, *q), (1.0, 9.0, 9.0))
    turns.draw(1.0, q + np.radians([12.4, -0.26]), poses, whole)
    assert [label.text for label in labels] == ["1: 12°", "2: 0.3°"] and labels[1].visible
    assert labels[1].position == (7.0, 8.0, 9.0)
    turns.draw(1.0, unknown, poses, whole)
    assert not labels[0].visible and "nan" not in labels[0].text
    turns.draw(0.0, q, poses, whole)
    assert not labels[0].visible, "hidden again after a reset"


def test_poses_of_another_scene_are_none_of_this_page(monkeypatch: pytest.MonkeyPatch) -> None:
    """The next scene, whose robot has other joints, arrives while the page is still the one of the scene
    before. This page gets no poses of the new robot."""
    robot, now = load_robot("iiwa14"), object()
    recording = SimpleNamespace(block=SimpleNamespace(poses=lambda: np.ones((4, 7))))
    learner = SimpleNamespace(ready=now, read=lambda look: look(recording))
    ready = SimpleNamespace(robot=robot)
    mock = MagicMock()
    monkeypatch.setattr("app.tab.context.InView", mock)  # it sends a script to the browser
    made: Any = (mock, learner, ready, {}, mock)
    page = PageContext(*made)
    assert page.poses() is None
    assert page.poses_or_still().shape == (robot.n + 1, 7)
    learner.ready = ready
    assert page.poses() is not None
