"""`himpc-lab controllers`."""

from __future__ import annotations

from app.commands.output import print_list


def controllers(json: str | None = None) -> int:
    """List the controllers.

    Args:
        json: write JSON to this file, or to standard output for "-".
    """
    from himpc.catalog import CONTROLLERS, VELOCITY_CONTROLLERS

    return print_list("Controllers", "controller", CONTROLLERS | VELOCITY_CONTROLLERS, json)
