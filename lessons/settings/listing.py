"""The list of all settings for users, with their allowed and present values, and of those often compared."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from lessons.settings.assignments import assignment
from lessons.settings.schema import Setting
from lessons.settings.settings import SceneSettings

_BY_PLACE = re.compile(r"levels\.\d+\.\w+")


@dataclass(frozen=True)
class SettingLine:
    """One setting, as text.

    Attributes:
        path: as in `--set`; in a list of several scenes, "*" stands for a name.
        now: its value, as the user types it.
        allowed: the allowed values.
        unit: of the value.
        help: a description.
    """

    path: str
    now: str
    allowed: str
    unit: str
    help: str


def lines(settings: SceneSettings) -> list[SettingLine]:
    """Returns every setting of a scene in the order of the page. Levels are listed by their names only,
    although a path may also contain a level's place."""
    return [_line(settings, setting, setting.path) for setting in _listed(settings)]


def reference(scenes: Sequence[SceneSettings]) -> list[SettingLine]:
    """Returns every setting of several scenes of a kind, with "*" for names; `now` is the value of the first
    scene that has it."""
    by_pattern: dict[str, SettingLine] = {}
    for settings in scenes:
        for setting in _listed(settings):
            if setting.pattern not in by_pattern:
                by_pattern[setting.pattern] = _line(settings, setting, setting.pattern)
    return sorted(by_pattern.values(), key=lambda line: scenes[0].rank(line.path))


def _listed(settings: SceneSettings) -> list[Setting]:
    return [setting for setting in settings.table().values() if not _BY_PLACE.fullmatch(setting.path)]


def _line(settings: SceneSettings, setting: Setting, path: str) -> SettingLine:
    now = assignment(setting.path, setting.read(settings)).partition("=")[2]
    shown = setting.shown
    return SettingLine(path, now, str(setting.form), shown.unit, shown.help or shown.label)


def usual_settings(settings: SceneSettings) -> list[Setting]:
    """Returns the settings of a scene that are often compared, except the controllers, in the order of the
    page."""
    return [setting for setting in settings.table().values() if setting.shown.tries and not setting.shorthand]
