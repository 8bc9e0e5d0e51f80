"""The obstacles that the robot avoids, with arrows for dragging them, and those whose reported place is
wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product

import numpy as np
import viser

from app.html.palette import RGB
from app.view.surroundings import placed, solid
from app.view.targets import Handle, put
from robots.collision import Ball, Box, Floor, Obstacle

_COLOUR: RGB = (180, 120, 110)
_ARROWS = 0.35  # m: how far the arrows extend beyond the obstacle

Moved = Callable[[str, tuple[float, float, float]], None]
_WRONG: RGB = (150, 40, 30)
_FILL = 0.12
_LINE = 3.0  # pixels
_ABOVE = 0.08  # m: height of a name above its obstacle

Pair = tuple[Ball | Box, Ball | Box]


class Obstacles:
    """Boxes and balls; the page always shows the floor. Boxes and balls are redrawn when the set of obstacles
    changes; otherwise they are only moved."""

    def __init__(self, scene: viser.SceneApi, moved: Moved) -> None:
        """moved: called with an obstacle's name and the new position of its centre, m."""
        self._scene, self._moved = scene, moved
        self._shown: tuple[Ball | Box, ...] = ()
        self._solids: list[_Solid] = []

    def show(self, obstacles: tuple[Obstacle, ...], arrows: bool) -> None:
        """Shows the obstacles of the session. arrows: whether the obstacles have arrows and can be moved."""
        now = tuple(sorted((each for each in obstacles if not isinstance(each, Floor)), key=_name))
        if _shapes(now) != _shapes(self._shown):
            for solid in self._solids:
                solid.remove()
            self._solids = [_Solid(self._scene, index, each, self._moved) for index, each in enumerate(now)]
        self._shown = now
        for solid, each in zip(self._solids, now, strict=True):
            solid.follow(each, arrows)


def _name(obstacle: Ball | Box) -> str:
    return obstacle.name


def _shapes(obstacles: tuple[Ball | Box, ...]) -> tuple[Ball | Box, ...]:
    return tuple(replace(each, centre=(0.0, 0.0, 0.0)) for each in obstacles)


class _Solid:
    """One obstacle with its arrows."""

    def __init__(self, scene: viser.SceneApi, index: int, obstacle: Ball | Box, moved: Moved) -> None:
        self._body = solid(scene, f"/obstacle/{index}", obstacle, _COLOUR, **placed(obstacle))
        size = 0.5 * max(obstacle.size) if isinstance(obstacle, Box) else obstacle.radius
        self._handle = Handle(
            scene,
            f"/obstacle_arrows/{index}",
            "xyz",
            size + _ARROWS,
            position=obstacle.centre,
            disable_sliders=True,
            line_width=2.0,
        )

        def dragged() -> None:
            x, y, z = self._handle.position.tolist()
            self._body.position = (x, y, z)
            moved(obstacle.name, (x, y, z))

        self._handle.listen(dragged)

    def follow(self, obstacle: Ball | Box, arrows: bool) -> None:
        self._handle.control.visible = arrows
        if not self._handle.held:
            put(self._body, obstacle.centre)
            put(self._handle.control, obstacle.centre)

    def remove(self) -> None:
        self._body.remove()
        self._handle.control.remove()


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
        root = scene.add_frame(node, show_axes=False, **placed(told))
        solid(scene, f"{node}/fill", told, _WRONG, opacity=_FILL)
        if isinstance(told, Box):
            scene.add_line_segments(
                f"{node}/outline", _edges(told), _WRONG, thickness=_LINE, thickness_units="screen"
            )
        else:
            scene.add_icosphere(
                f"{node}/outline", radius=told.radius, color=_WRONG, subdivisions=2, wireframe=True
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
