"""A velocity-level scene: robot, settings, mission and start, as data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from lessons.scenes.scene import Scene
from lessons.settings.velocity import VelocitySettings


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class VelocityScene(Scene):
    """A scene whose robot takes velocities. The robot starts at rest, and the options of the settings create
    the mission."""

    settings: VelocitySettings
    duration: float = 16.0
