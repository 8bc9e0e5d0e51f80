"""The Start tab's sentences about levels agree with the stack, in every scene and after every change."""

from __future__ import annotations

import html
import re
from collections.abc import Sequence

import pytest

from app.html.palette import css, level_colours
from app.link.messages import TaskView
from app.panels.torque.start import guide, spoken
from app.panels.velocity.start import guide as velocity_guide
from app.view.targets import draggable
from app.worker.simulation import TorqueRun, start
from himpc.htmpc import base_joints
from himpc.stack import Level
from lessons.course import load_lesson
from lessons.scenes.catalog import load_scene, prepared
from lessons.scenes.names import SCENES, VELOCITY_SCENES
from lessons.settings.velocity import VelocitySettings

CHANGES = (
    "order=posture,orientation,position",
    "levels.orientation.enabled=false",
    "levels.position.enabled=false",
)


def opened(scene: str, change: str = "") -> tuple[tuple[TaskView, ...], Sequence[Level]]:
    """Returns the page's data of a scene's tasks, and its stack."""
    urdf = load_lesson("your-robot").urdf if scene == "hold" else None
    run = start(prepared(load_scene(scene, urdf), None, (change,) if change else ()), 0)
    assert isinstance(run, TorqueRun)
    return run.tasks(), run.session.settings.levels


def told(text: str) -> dict[str, int]:
    """Returns the levels that a text names, and their numbers."""
    return {
        html.unescape(name): int(place) for name, place in re.findall(r"<b>([^<]+)</b> \(level (\d+)\)", text)
    }


def enabled(levels: Sequence[Level]) -> dict[str, int]:
    return {spoken(level.name): place for place, level in enumerate(levels, 1) if level.enabled}


@pytest.mark.parametrize(
    ("scene", "change"), [*((name, "") for name in SCENES), *(("iiwa14-hold", each) for each in CHANGES)]
)
def test_levels_are_named_where_they_are(scene: str, change: str) -> None:
    """The guide names all enabled levels with their names and numbers, and the colour of the dragged
    level."""
    tasks, levels = opened(scene, change)
    colours = level_colours([level.name for level in levels])
    first = guide(tasks, levels, colours, dragged=False)
    target = draggable(tasks)
    if target is None:
        assert "curve" in first and not told(first)
        return
    if "position.enabled" not in change:
        assert told(first) == enabled(levels)
        own = next(
            level for level in levels if any(task.name == target.position.name for task in level.tasks)
        )
        assert f"<b>{spoken(own.name)}</b>" in first and css(colours[own.name]) in first
    else:
        assert "switched off" in first
    then = told(guide(tasks, levels, colours, dragged=True))
    assert then.items() <= enabled(levels).items() and len(then) == 2
    # The guide names no level of another scene, and no other numbers than those of levels.
    rest = re.sub(r"<b>[^<]+</b> \(level \d+\)|<[^>]+>", "", first)
    assert "level" not in rest.replace("Its level", "")
    assert scene != "planar3-plane" or told(first) == {"reach": 1, "pose": 2, "wrist": 3}


def test_one_level_or_none_offers_nothing_that_is_not_there() -> None:
    tasks, levels = opened("planar3-hold")
    for few in (levels[:1], ()):
        then = guide(tasks, few, level_colours([level.name for level in levels]), dragged=True)
        assert "switch a level off" not in then and "Add a level" in then


@pytest.mark.parametrize("scene", VELOCITY_SCENES)
def test_roles_have_the_levels_that_are_told(scene: str) -> None:
    """The guide names the level of each role, also after a swap, and while a role has no task."""
    made = load_scene(scene)
    assert isinstance(made.settings, VelocitySettings)
    roles = [level.name for level in made.settings.levels]
    drives = bool(base_joints(made.robot))
    for order in (roles, roles[::-1]):
        places = {role: float(place) for place, role in enumerate(order, 1)}
        text = velocity_guide(scene, drives, places, dragged=False)
        found = [int(place) for place in re.findall(r"<b>level (\d)</b>", text)]
        assert not found or found == [places[role] for role in roles]
    assert (
        "without a task" in velocity_guide(scene, drives, dict.fromkeys(roles, float("nan")), False)
        or not found
    )
