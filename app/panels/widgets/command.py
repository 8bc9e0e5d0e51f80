"""Commands of the page, each with a key: in viser's palette (Ctrl K) and on the keyboard."""

from __future__ import annotations

from collections.abc import Callable

import viser

CAMERA_KEYS = frozenset({"W", "A", "S", "D", "Q", "E", "ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight"})
"""What moves viser's camera, whatever is held with it: no command has one of these."""


def add_command(
    gui: viser.GuiApi, label: str, key: str, does: Callable[[], object], shift: bool = False
) -> None:
    """A command that calls `does` on viser's event loop; shift: its key counts together with Shift."""
    command = gui.add_command(
        label,
        hotkey=key,  # pyright: ignore[reportArgumentType]
        modifier="shift" if shift else None,
    )

    @command.on_trigger
    async def _(_: object) -> None:
        does()
