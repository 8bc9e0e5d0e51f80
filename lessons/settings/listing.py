"""The list of all settings for users, with their allowed and present values."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from lessons.settings.assignments import assignment
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
    paths = [path for path in settings.paths() if not _BY_PLACE.fullmatch(path)]
    order = [entry.path for entry in settings.entries]
    told = {path: _pattern(settings, path) for path in paths}
    paths.sort(key=lambda path: order.index(told[path]) if told[path] in order else len(order))
    return [_line(settings, path, path) for path in paths]


def reference(scenes: Sequence[SceneSettings]) -> list[SettingLine]:
    """Returns every setting of several scenes of a kind, with "*" for names; `now` is the value of the first
    scene that has it."""
    found: dict[str, SettingLine] = {}
    for settings in scenes:
        for path in settings.paths():
            pattern = _pattern(settings, path)
            if pattern not in found and not _BY_PLACE.fullmatch(path):
                found[pattern] = _line(settings, path, pattern)
    order = [entry.path for settings in scenes for entry in settings.entries]
    return sorted(found.values(), key=lambda line: order.index(line.path))


def _pattern(settings: SceneSettings, path: str) -> str:
    return next((entry.path for entry in settings.entries if entry.at(path)), path)


def _line(settings: SceneSettings, path: str, shown: str) -> SettingLine:
    entry, place = settings.entry(path), settings.place(path)
    now = assignment(path, place.read(settings)).partition("=")[2]
    words = entry.label if not entry.help else entry.help
    return SettingLine(shown, now, str(place.form), entry.unit, words)
