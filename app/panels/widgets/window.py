"""A window over the page that a key opens and closes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import viser

from app.panels.widgets.command import add_command, on_click


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
