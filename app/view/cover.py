"""The capsules between which distances are measured, drawn on request."""

from __future__ import annotations

import viser

from robots import Robot
from robots.covering.cover_of import cover_of
from robots.shapes.capsules import cover_parts

_OPACITY = 0.35


class CoverView:
    """One translucent mesh per body. A mesh is a child of the body's frame and moves with the links of
    `RobotView`. Meshes are created when they are first shown."""

    def __init__(self, scene: viser.SceneApi, robot: Robot, root: str = "/robot") -> None:
        """root: name of the robot's node."""
        self._scene, self._robot, self._root = scene, robot, root
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
                    f"{self._root}/{part.joint or 'base'}/cover",
                    part.vertices,
                    part.faces,
                    color=part.colour,
                    opacity=_OPACITY,
                    cast_shadow=False,
                    receive_shadow=False,
                )
                for part in cover_parts(cover_of(self._robot))
            ]
        for node in self._nodes:
            node.visible = on
