"""`himpc-lab scenes`."""

from __future__ import annotations

from app.commands.output import print_list


def scenes(json: str | None = None) -> int:
    """List the scenes.

    Args:
        json: write JSON to this file, or to standard output for "-".
    """
    from lessons.scenes.names import ALL_SCENES

    return print_list("Scenes", "scene", ALL_SCENES, json)
