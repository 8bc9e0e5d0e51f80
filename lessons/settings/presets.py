"""The settings that are most often compared: those whose description lists values to try."""

from __future__ import annotations

from lessons.settings.schema import Setting
from lessons.settings.settings import SceneSettings


def usual_settings(settings: SceneSettings) -> list[Setting]:
    """Returns the settings of a scene that are often compared, except the controllers, in the order of the
    page."""
    return [setting for setting in settings.table().values() if setting.shown.tries and not setting.shorthand]
