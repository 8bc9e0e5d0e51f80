"""The settings that are most often compared: those whose entry lists values to try."""

from __future__ import annotations

from lessons.settings.entry import Entry
from lessons.settings.settings import SceneSettings


def usual_settings(settings: SceneSettings) -> tuple[Entry, ...]:
    """Returns the settings of a scene that are often compared, except the controllers, in the order of the
    page."""
    paths = [path for path, place in settings.places().items() if not place.shorthand]
    found = (entry.at(path) for entry in settings.entries if entry.tries for path in paths)
    return tuple(entry for entry in found if entry is not None)
