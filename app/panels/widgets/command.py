"""Commands of the page, available by key, in viser's palette (Ctrl K), or by a button; and a window that a
key opens and closes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

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


def on_change(handle: viser.GuiInputHandle[Any], does: Callable[[], object]) -> None:
    """Calls `does` on viser's event loop when the browser changes the value of a control."""

    @handle.on_update
    async def _(event: viser.GuiEvent[Any]) -> None:
        if event.client is not None:
            does()


class PopupWindow:
    """A window whose content is built each time it opens."""

    def __init__(
        self, gui: viser.GuiApi, title: str, hotkey: str, fill: Callable[[], None], shift: bool = False
    ) -> None:
        """hotkey: opens and closes the window; shift: whether the key is used together with Shift."""
        self._gui, self._title, self._fill = gui, title, fill
        self._modal: Any = None  # viser's type has no public name
        add_command(gui, title, hotkey, self._switch, shift)

    def _switch(self) -> None:
        if self._modal is None:
            self.open()
        else:
            self.close()

    def open(self) -> None:
        if self._modal is not None:
            return
        self._modal = modal = self._gui.add_modal(self._title)
        try:
            with modal:
                self._button()
                self._fill()
        except KeyError:
            # Another scene was loaded: the page is rebuilt, and this window no longer exists in viser.
            self._modal = None

    def _button(self) -> None:
        shut = self._gui.add_button("Close", color="gray")

        on_click(shut, self.close)

    def close(self) -> None:
        modal, self._modal = self._modal, None
        if modal is not None:
            modal.close()
