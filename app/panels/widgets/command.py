"""Commands of the page, available by key and in viser's palette (Ctrl K), or by a button."""

from __future__ import annotations

from collections.abc import Callable

import viser

CAMERA_KEYS = frozenset({"W", "A", "S", "D", "Q", "E", "ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight"})
"""Keys that move viser's camera, with any modifier; a command cannot use them."""


def add_command(
    gui: viser.GuiApi, label: str, key: str, does: Callable[[], object], shift: bool = False
) -> None:
    """Adds a command that calls `does` on viser's event loop; shift: whether the key is used together with
    Shift."""
    command = gui.add_command(
        label,
        hotkey=key,  # pyright: ignore[reportArgumentType]
        modifier="shift" if shift else None,
    )

    @command.on_trigger
    async def _(_: object) -> None:
        does()


def on_click(button: viser.GuiButtonHandle | viser.GuiButtonGroupHandle, does: Callable[[], object]) -> None:
    """Calls `does` on viser's event loop when a button is pressed."""

    @button.on_click
    async def _(_: object) -> None:
        does()
