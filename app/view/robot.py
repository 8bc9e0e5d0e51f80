"""The robot in the 3D view: its links, placed by poses from the simulation; on request with their capsules,
with how far each joint has turned, and clickable; the ghost beside it; and the recorded run of the first
lesson."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from importlib.resources import files
from typing import Any

import numpy as np
import pinocchio as pin
import viser

from app.adapter import private
from app.client.moment import GhostState
from app.client.recording import PlotWindow
from app.html.palette import GHOST, RGB
from app.link.poses import LinkPoses
from app.view.camera import covered_shares, look, turn
from app.view.surroundings import Ground
from app.view.trails import NOTHING, trace
from robots import Robot, load_robot
from robots.covering.cover_of import cover_of
from robots.shapes.capsules import cover_parts
from robots.shapes.link_shapes import link_shapes

_STILL = 1e-4
"""Smaller changes of a link's pose are not sent to the page; they move a link by about a tenth of a pixel.
The number applies to the position, m, and to each component of the quaternion."""
ARROW = 1.2
"""Length of an arrow with its head, as a multiple of the gizmo's size."""
_SHORT = 0.4
"""The camera looks at a shorter arm as at an arm of this length, m."""
_OPACITY = 0.35


class RobotView:
    """One frame per joint, with the shapes of the joint's link.

    links: for every shape, the number of the joint that moves it (0 for the base) and its mesh.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        robot: Robot,
        root: str = "/robot",
        colour: RGB | None = None,
        opacity: float | None = None,
    ) -> None:
        """root: name of the parent node; colour, opacity: of the whole robot; None: the robot is opaque and
        has its own colours."""
        shapes = link_shapes(robot)
        self._frames = [
            scene.add_frame(f"{root}/{joint}", show_axes=False) for joint in range(1, robot.model.njoints)
        ]
        self.links = [
            (
                shape.joint,
                scene.add_mesh_simple(
                    f"{root}/{shape.joint or 'base'}/shape{index}",
                    shape.vertices,
                    shape.faces,
                    color=colour or shape.colour,
                    opacity=opacity,
                ),
            )
            for index, shape in enumerate(shapes)
            if shape.joint or colour is None  # two bases at the same place would flicker
        ]
        self._shown = np.full((len(self._frames), 7), np.nan)

    def move(self, poses: np.ndarray) -> None:
        """poses: (J − 1, 7), position, m, and quaternion wxyz of all joints. For a robot at rest no message
        is sent, so that the browser need not draw."""
        moved = ~(np.abs(poses - self._shown) <= _STILL)  # NaN: never shown
        shifted, turned = moved[:, :3].any(axis=1), moved[:, 3:].any(axis=1)
        for k in np.flatnonzero(shifted):
            private.shift(self._frames[k], poses[k, :3])
            self._shown[k, :3] = poses[k, :3]
        for k in np.flatnonzero(turned):
            private.turn(self._frames[k], poses[k, 3:])
            self._shown[k, 3:] = poses[k, 3:]


def camera_for(robot: Robot) -> tuple[np.ndarray, np.ndarray, float]:
    """Returns (position, look_at) of a camera that shows the robot well, and the length of its arm, m."""
    points, direction, length = _home(robot)
    reach = max(_SHORT, length)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return middle + reach * direction, middle, reach


def gizmo_size(robot: Robot) -> float:
    """Returns the size of the arrows and rings at a robot's targets, m."""
    return _gizmo(_home(robot)[2])


def target_radius(robot: Robot) -> float:
    """Returns the radius of the ball that marks a target, m: 28 mm at an arm of 1.3 m."""
    return float(np.clip(0.022 * _home(robot)[2], 0.006, 0.03))


def _gizmo(length: float) -> float:
    return float(np.clip(0.2 * length, 0.05, 0.4))


def _home(robot: Robot) -> tuple[np.ndarray, np.ndarray, float]:
    """Positions of base, joints and tip in the home posture, (k, 3) m; a viewing direction; and the length of
    the arm, m."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, robot.home)
    joints = np.array([data.oMi[j].translation for j in range(1, robot.model.njoints)])
    tip = data.oMf[robot.frame_id(robot.tip)].translation
    ends = [frame.translation for frame in data.oMf]
    points = np.vstack([np.zeros(3), joints, tip])
    length = float(np.sum(np.linalg.norm(np.diff(points[1:], axis=0), axis=1)))
    planar = float(np.ptp(points[:, 2])) < 0.05 * length
    direction = np.array([0.15, -0.55, 1.3]) if planar else np.array([1.0, 0.75, 0.55])
    arrows = tip + ARROW * _gizmo(length) * np.eye(3)
    return np.vstack([points, ends, arrows]), direction, length


def aim(
    camera: viser.CameraHandle,
    robot: Robot,
    phone: bool,
    room: np.ndarray,
    ways: Sequence[np.ndarray] = (),
    covered: tuple[float, float] = (0.0, 0.0),
) -> None:
    """Turns the camera to a robot. room: the points (k, 3), m, that the robot will reach; ways: the paths of
    its hand, (k, 3) each, m; phone: whether viser's sheet covers the lower part of the scene; covered:
    heights of the panels that cover the scene from above and from below, px. The robot is shown smaller, in
    the free part."""
    if not len(room):
        points, direction, _ = _home(robot)
        look(camera, np.vstack([points, *ways]), phone, direction, covered)
        return
    _, at, reach = camera_for(robot)
    points = np.vstack([at, room])
    low, high = points.min(axis=0), points.max(axis=0)
    at = np.array([*(0.5 * (low + high))[:2], 0.4])
    wide = 0.5 * float(np.linalg.norm((high - low)[:2])) + 0.5 * reach
    eye = at + 1.15 * wide * np.array([0.7, -0.95, 0.9])
    _, below = covered_shares(camera, phone, covered)
    eye = at + (1.0 + 1.17 * below) * (eye - at)
    down = np.array([0.0, 0.0, 0.7 * below * float(np.linalg.norm(eye - at))])
    eye, at = eye - down, at - down
    camera.up_direction = (0.0, 0.0, 1.0)
    turn(camera, eye, at)


def look_at(camera: viser.CameraHandle, robot: Robot, base: np.ndarray) -> None:
    """Turns the camera to a robot. base: position of the robot's base, (3,) m."""
    eye, at, _ = camera_for(robot)
    turn(camera, eye + base, at + base)


class LinkPicker:
    """Makes links clickable on request only, as a clickable link hides objects behind it from the mouse."""

    def __init__(self, view: RobotView, robot: Robot, chosen: Callable[[str], None]) -> None:
        """chosen: called with the name of the link that was clicked."""
        self._links, self._chosen, self._on = view.links, chosen, False
        self._names: dict[int, str] = {}
        for name in robot.frames:
            self._names.setdefault(robot.model.frames[robot.frame_id(name)].parentJoint, name)

    def follow(self, on: bool) -> None:
        """on: whether links can be clicked."""
        if on == self._on:
            return
        self._on = on
        for joint, mesh in self._links:
            if on and joint in self._names:
                self._attach(mesh, self._names[joint])
            else:
                mesh.remove_click_callback("all")

    def _attach(self, mesh: viser.MeshHandle, name: str) -> None:
        @mesh.on_click
        async def _(_: object) -> None:
            self._chosen(name)


class CoverView:
    """One translucent mesh per body. A mesh is a child of the body's frame and moves with the links of
    `RobotView`. Meshes are created when they are first shown."""

    def __init__(self, scene: viser.SceneApi, robot: Robot) -> None:
        self._scene, self._robot = scene, robot
        self._nodes: list[viser.MeshHandle] | None = None
        self._on = False

    def draw(self, on: bool) -> None:
        """on: whether the meshes are shown."""
        if on == self._on:
            return
        self._on = on
        if self._nodes is None:
            self._nodes = [
                self._scene.add_mesh_simple(
                    f"/robot/{part.joint or 'base'}/cover",
                    part.vertices,
                    part.faces,
                    color=part.colour,
                    opacity=_OPACITY,
                )
                for part in cover_parts(cover_of(self._robot))
            ]
        for node in self._nodes:
            node.visible = on


_GHOSTLY = 0.38


class GhostView:
    """The 3D view of the ghost; it exists while there is a ghost."""

    def __init__(self, scene: viser.SceneApi, robot: Robot, words: str) -> None:
        self._root = scene.add_frame("/ghost", show_axes=False)
        self._robot = RobotView(scene, robot, "/ghost", GHOST, _GHOSTLY)
        self._trace = scene.add_line_segments("/ghost/trace", NOTHING, GHOST, thickness=0.004)
        self._label = scene.add_label("/ghost/label", f"ghost: {words}", anchor="bottom-center")

    def move(self, ghost: GhostState) -> None:
        self._robot.move(ghost.poses[:-1])
        at = ghost.poses[-1, :3] + np.array([0.0, 0.0, 0.08])
        if not np.allclose(at, self._label.position, atol=1e-4):
            self._label.position = at

    def draw(self, ghost: GhostState) -> None:
        """Draws the trace, about ten times per second."""
        self._trace.points = trace(ghost.way[:, -1, :3]) if len(ghost.way) else NOTHING

    def remove(self) -> None:
        self._root.remove()


_REST = 1.5
"""Time, s, for which the robot stands still at the end of the run, before the run is shown again."""


class RecordedRun:
    """The robot of the first lesson, moved as in a run that was recorded by `python -m docs.record`. It is
    removed with the rest of the scene when the page's own robot is there."""

    def __init__(self, client: viser.ClientHandle, phone: bool, now: float) -> None:
        """phone: see `aim`; now: the time, s, at which the run begins."""
        told: dict[str, Any] = json.loads(files("app.view").joinpath("recorded.json").read_text("utf-8"))
        robot = load_robot(told["robot"])
        self._q, self._period, self._began = np.array(told["q"]), float(told["period"]), now
        self._poses, self._view = LinkPoses(robot), RobotView(client.scene, robot, "/recorded")
        self._ground = Ground(client.scene, robot, np.empty((0, 3)))
        self._label = client.scene.add_label("/recorded/label", "a recorded run", anchor="bottom-center")
        aim(client.camera, robot, phone, np.empty((0, 3)))
        self.follow(now)

    def follow(self, now: float) -> None:
        """Shows the run at a time, s; it is repeated."""
        last = len(self._q) - 1
        t = (now - self._began) % (last * self._period + _REST)
        poses = self._poses.at(self._q[min(int(t / self._period), last)])
        assert poses is not None
        self._view.move(poses[:-1])
        self._ground.move(poses)
        self._label.position = poses[-1, :3] + (0.0, 0.0, 0.08)


_BEGIN = 0.05
"""Simulated time, s, until which the robot counts as being at its start."""


class JointTurns:
    """A label at each joint, such as "3: 12°"; no labels if the recording does not contain the start."""

    def __init__(self, scene: viser.SceneApi, joints: Sequence[int]) -> None:
        """joints: indices of the joints that get a label, in the order of the poses, from 1 on."""
        self._joints = joints
        self._labels = [
            scene.add_label(f"/turn/{k}", "", visible=False, anchor="center-center") for k in joints
        ]
        self._start: np.ndarray | None = None

    def draw(self, t: float, q: np.ndarray, poses: np.ndarray, window: PlotWindow) -> None:
        """t: simulated time, s; q: (n,) rad; poses: (J, 7), of the joints and the tip; window: the
        recording up to this time."""
        if t < _BEGIN:
            self._start = None
        elif self._start is None:
            self._start = _start_of(window)
        start = self._start if np.isfinite(q).all() else None
        for k, label in enumerate(self._labels):
            label.visible = start is not None
            if start is None:
                continue
            turn = abs(np.degrees(q[k] - start[k]))
            text = f"{k + 1}: {turn:.{0 if turn >= 10 else 1}f}°"
            label.text = text
            label.position = tuple(poses[self._joints[k] - 1, :3])


def _start_of(window: PlotWindow) -> np.ndarray | None:
    fields = window.layout.fields
    early = np.flatnonzero(window.columns(fields["t"])[:, 0] < _BEGIN)
    return window.columns(fields["q"])[early[0]] if len(early) else None
