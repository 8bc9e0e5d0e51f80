"""`himpc-lab scenes`."""

from __future__ import annotations

from app.commands.output import print_table, write_json


def scenes(json: str | None = None) -> int:
    """List the scenes.

    Args:
        json: write JSON to this file, or to standard output for "-".
    """
    from lessons.scenes import SCENES

    if json is not None:
        write_json([{"name": name, "description": line} for name, line in SCENES.items()], json)
    else:
        print_table("Scenes", ("scene", "what it is"), list(SCENES.items()))
    return 0
