"""The obstacles that the robot avoids, with arrows for dragging them."""

from __future__ import annotations

import time
from collections.abc import Callable, Coroutine
from dataclasses import replace
from typing import Any

import numpy as np
import viser
import viser.transforms as vtf

from app.client.pending_edit import HOLD
from app.html.palette import RGB
from robots.collision import Ball, Box, Floor, Obstacle

_COLOUR: RGB = (180, 120, 110)
_ARROWS = 0.35  # m: how far the arrows extend beyond the obstacle

Moved = Callable[[str, tuple[float, float, float]], None]


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
    """One obstacle. The user's drag has priority: for a moment after it, `follow` does not move the
    obstacle."""

    def __init__(self, scene: viser.SceneApi, index: int, obstacle: Ball | Box, moved: Moved) -> None:
        self._touched = -float("inf")
        self._body: viser.BoxHandle | viser.IcosphereHandle
        if isinstance(obstacle, Box):
            turn = vtf.SO3.from_z_radians(obstacle.yaw).wxyz
            self._body = scene.add_box(
                f"/obstacle/{index}",
                color=_COLOUR,
                dimensions=obstacle.size,
                position=obstacle.centre,
                wxyz=turn,
                cast_shadow=False,
            )
            size = 0.5 * max(obstacle.size)
        else:
            self._body = scene.add_icosphere(
                f"/obstacle/{index}",
                radius=obstacle.radius,
                color=_COLOUR,
                position=obstacle.centre,
                cast_shadow=False,
            )
            size = obstacle.radius
        self._arrows = scene.add_transform_controls(
            f"/obstacle_arrows/{index}",
            scale=size + _ARROWS,
            position=obstacle.centre,
            disable_rotations=True,
            disable_sliders=True,
            depth_test=False,
            line_width=2.0,
        )
        self._arrows.on_update(self._listener(obstacle.name, moved))

    def _listener(
        self, name: str, moved: Moved
    ) -> Callable[[viser.TransformControlsEvent], Coroutine[Any, Any, None]]:
        async def hear(_: viser.TransformControlsEvent) -> None:
            self._touched = time.monotonic()
            x, y, z = (float(value) for value in self._arrows.position)
            self._body.position = (x, y, z)
            moved(name, (x, y, z))

        return hear

    def follow(self, obstacle: Ball | Box, arrows: bool) -> None:
        if self._arrows.visible != arrows:
            self._arrows.visible = arrows
        if time.monotonic() - self._touched < HOLD:
            return
        for handle in (self._body, self._arrows):
            if not np.allclose(obstacle.centre, handle.position, rtol=0.0, atol=1e-4):
                handle.position = obstacle.centre

    def remove(self) -> None:
        self._body.remove()
        self._arrows.remove()
