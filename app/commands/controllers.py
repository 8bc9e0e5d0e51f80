"""`himpc-lab controllers`."""

from __future__ import annotations

from app.commands.output import print_table, write_json


def controllers(json: str | None = None) -> int:
    """List the controllers.

    Args:
        json: write JSON to this file, or to standard output for "-".
    """
    from himpc import CONTROLLERS

    if json is not None:
        write_json([{"name": name, "description": line} for name, line in CONTROLLERS.items()], json)
    else:
        print_table("Controllers", ("controller", "what it is"), list(CONTROLLERS.items()))
    return 0
