"""Manipulability ellipsoids of the levels, drawn at the frames that they move."""

from __future__ import annotations

import numpy as np
import viser
import viser.transforms as vtf

from app.html.palette import BOUND, RGB
from himpc.kinematics.configuration import Configuration
from himpc.stack import Stack
from lessons.geometry.ellipsoids import Ellipsoid, ellipsoids
from robots import Robot

_SIZE = {False: 0.3, True: 0.1}
"""Length in the picture, m, per m/s of a frame and per rad/s of its rotation, for joints of unit speed."""
_THIN = 0.004  # m: thickness of directions without motion
_STILL = 2e-3  # m: smaller changes are invisible


class EllipsoidView:
    """The ellipsoids; they are created when they are first shown."""

    def __init__(self, scene: viser.SceneApi, robot: Robot, colours: dict[str, RGB]) -> None:
        self._scene, self._robot, self._colours = scene, robot, colours
        self._data = robot.model.createData()
        self._nodes: dict[str, viser.IcosphereHandle] = {}
        self._shown: dict[str, np.ndarray] = {}

    def draw(self, on: bool, q: np.ndarray, stack: Stack) -> None:
        """on: whether the ellipsoids are shown; q: joint positions of the instant, (n,)."""
        found: list[Ellipsoid] = []
        if on and np.isfinite(q).all():
            found = ellipsoids(Configuration(self._robot, self._data, q, np.zeros_like(q)), stack)
        wanted = {each.task: each for each in found}
        for name, node in self._nodes.items():
            node.visible = name in wanted
        for name, each in wanted.items():
            self._place(name, each)

    def _place(self, name: str, each: Ellipsoid) -> None:
        scale = np.maximum(_SIZE[each.turns] * each.radii, _THIN)
        shape = np.concatenate([(each.axes * scale).ravel(), each.position])
        if name in self._nodes and np.abs(shape - self._shown[name]).max() < _STILL:
            return
        self._shown[name] = shape
        size = (float(scale[0]), float(scale[1]), float(scale[2]))
        turn = vtf.SO3.from_matrix(each.axes).wxyz
        node = self._nodes.get(name)
        if node is None:
            self._nodes[name] = self._scene.add_icosphere(
                f"/ellipsoids/{len(self._nodes)}",
                radius=1.0,
                color=self._colours.get(each.level, BOUND),
                opacity=0.35,
                scale=size,
                wxyz=turn,
                position=each.position,
            )
        else:
            node.scale, node.wxyz, node.position = size, turn, each.position
