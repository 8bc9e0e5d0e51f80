"""Settings told as assignments "PATH=VALUE": what differs between a scene's own and others."""

from __future__ import annotations

import json
from typing import Any

from lessons.kinds import AnyScene, AnySettings, changed_any, paths_of
from lessons.recording.run import parse_assignment
from lessons.settings.torque import SceneSettings, value_at
from lessons.settings.velocity import MobileSettings
from lessons.settings.velocity import value_at as mobile_value_at
from robots import InputError
from robots.collision import Ball, Floor

_SHORTHANDS = ("Q", "R")
"""Paths that set every level at once."""


def assignment(path: str, value: Any) -> str:
    """ "PATH=VALUE" such that `parse_assignment` gives the same value again, to the last bit."""
    if path == "order" and not any("," in name for name in value):
        value = ",".join(value)
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"), default=_plain)
    if isinstance(value, str):
        plain = f"{path}={value}"
        if value and "\n" not in value and _parsed(plain) == value:
            return plain
    return f"{path}={text}"


def _plain(value: Any) -> Any:
    return value.item()  # NumPy's integers and booleans


def _parsed(text: str) -> Any:
    try:
        return parse_assignment(text)[1]
    except InputError:
        return None


def differences(scene: AnyScene, settings: AnySettings) -> tuple[str, ...]:
    """The assignments that turn a scene's own settings into others of the same scene.

    The controller comes first, so that what else it brings (its rate) is told only where it differs.

    Args:
        scene: as it is loaded.
        settings: reached from its settings by events.

    Raises:
        InputError: no assignment can express them.
    """
    now = scene.settings
    found: list[str] = []
    for path in sorted(filter(_is_plain, paths_of(scene)), key=lambda path: path != "controller"):
        value = _value(settings, path)
        if value != _value(now, path):
            found.append(assignment(path, value))
            now = changed_any(now, *parse_assignment(found[-1]))
    if isinstance(now, MobileSettings) and isinstance(settings, MobileSettings):
        now, obstacles = _with_obstacles(now, settings)
        found += obstacles
    if now != settings:
        raise InputError(
            f"these settings of scene '{scene.name}' cannot be told as assignments: reset them and try again"
        )
    return tuple(found)


def _is_plain(path: str) -> bool:
    """Whether it is no second way to what other paths reach."""
    head, _, rest = path.partition(".")
    name, _, key = rest.rpartition(".")
    return path not in _SHORTHANDS and not (head == "levels" and (name.isdigit() or key in ("K_p", "K_v")))


def _value(settings: AnySettings, path: str) -> Any:
    if isinstance(settings, SceneSettings):
        return value_at(settings, path)
    return mobile_value_at(settings, path)


def _with_obstacles(now: MobileSettings, wanted: MobileSettings) -> tuple[MobileSettings, list[str]]:
    """Obstacles that appeared or were moved stand at the end, in the order in which that happened."""
    obstacles = wanted.htmpc.obstacles
    left = {each.name for each in obstacles}
    gone = [
        assignment(f"obstacles.{each.name}", None) for each in now.htmpc.obstacles if each.name not in left
    ]
    told = gone
    result = now
    for count in range(len(obstacles) + 1):
        last = obstacles[len(obstacles) - count :]
        if any(isinstance(each, Floor) for each in last):
            break
        told = [
            *gone,
            *(
                assignment(
                    f"obstacles.{each.name}",
                    (*each.centre, each.radius) if isinstance(each, Ball) else each.centre,
                )
                for each in last
                if not isinstance(each, Floor)
            ),
        ]
        result = now
        for each in told:
            changed = changed_any(result, *parse_assignment(each))
            assert isinstance(changed, MobileSettings)
            result = changed
        if result.htmpc.obstacles == obstacles:
            break
    return result, told
