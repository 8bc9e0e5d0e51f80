"""Choosing a link by a click."""

from __future__ import annotations

from collections.abc import Callable

import viser

from app.view.robot import RobotView
from robots import Robot


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
