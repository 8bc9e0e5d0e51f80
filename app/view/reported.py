"""Obstacles whose reported place is wrong: an outline at the reported place, and a name at both places."""

from __future__ import annotations

from itertools import product

import numpy as np
import viser
import viser.transforms as vtf

from app.html.palette import RGB
from robots.collision import Ball, Box, Floor, Obstacle

_COLOUR: RGB = (150, 40, 30)
_FILL = 0.12
_LINE = 3.0  # pixels
_ABOVE = 0.08  # m: height of a name above its obstacle

Pair = tuple[Ball | Box, Ball | Box]


class ReportedObstacles:
    """The elements exist on the page only while a report differs from the true place."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._shown: list[Pair] = []
        self._nodes: list[viser.SceneNodeHandle] = []

    def show(self, obstacles: tuple[Obstacle, ...], reported: tuple[Obstacle, ...]) -> None:
        """obstacles: the true obstacles; reported: the obstacles that the controller gets, with the same
        names."""
        true = {each.name: each for each in obstacles if not isinstance(each, Floor)}
        told = [each for each in reported if not isinstance(each, Floor) and each.name in true]
        pairs = [(true[each.name], each) for each in told if true[each.name] != each]
        if pairs == self._shown:
            return
        self._shown = pairs
        for node in self._nodes:
            node.remove()
        self._nodes = [node for index, pair in enumerate(pairs) for node in self._draw(index, *pair)]

    def _draw(self, index: int, true: Ball | Box, told: Ball | Box) -> list[viser.SceneNodeHandle]:
        scene, node = self._scene, f"/reported/{index}"
        turn = vtf.SO3.from_z_radians(told.yaw if isinstance(told, Box) else 0.0).wxyz
        root = scene.add_frame(node, show_axes=False, position=told.centre, wxyz=turn)
        if isinstance(told, Box):
            scene.add_box(
                f"{node}/fill", color=_COLOUR, dimensions=told.size, opacity=_FILL, cast_shadow=False
            )
            scene.add_line_segments(
                f"{node}/outline", _edges(told), _COLOUR, thickness=_LINE, thickness_units="screen"
            )
        else:
            scene.add_icosphere(
                f"{node}/fill", radius=told.radius, color=_COLOUR, opacity=_FILL, cast_shadow=False
            )
            scene.add_icosphere(
                f"{node}/outline",
                radius=told.radius,
                color=_COLOUR,
                subdivisions=2,
                wireframe=True,
                cast_shadow=False,
            )
        # The reported obstacle is named at its foot and the true obstacle at its top. The names do not hide
        # each other.
        names = [
            scene.add_label(
                f"{node}_name/told", f"{told.name}, as reported", position=_end(told, -1), anchor="top-center"
            ),
            scene.add_label(f"{node}_name/true", true.name, position=_end(true, 1), anchor="bottom-center"),
        ]
        return [root, *names]


def _edges(box: Box) -> np.ndarray:
    """Returns the twelve edges of a box about its centre, (12, 2, 3) m."""
    corners = 0.5 * np.array(box.size) * np.array(list(product((-1.0, 1.0), repeat=3)))
    pairs = [(a, b) for a in range(8) for b in range(a + 1, 8) if (a ^ b).bit_count() == 1]
    return corners[np.array(pairs)].astype(np.float32)


def _end(obstacle: Ball | Box, side: int) -> tuple[float, float, float]:
    """Returns a point on the vertical line through the centre, m: the obstacle's lowest point (side −1), or a
    point above its top (side 1)."""
    x, y, z = obstacle.centre
    half = 0.5 * obstacle.size[2] if isinstance(obstacle, Box) else obstacle.radius
    return x, y, z + side * half + max(side, 0) * _ABOVE
