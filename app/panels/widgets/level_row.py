"""A level in one row: colour, name, error as a bar, freedom, buttons; its settings on request."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import viser

from app.adapter.names import ROW
from app.adapter.private import dom_id
from app.html.palette import BAD, RGB, css
from app.html.text import badge, bar, esc, quantity
from app.panels.widgets.command import on_click

ON, OFF, UP, DOWN, MORE = "on", "off", "▲", "▼", "⋯"
_LEAST = 1e-5
"""The error, m or rad, at which the bar begins; it is full at 1 m or 1 rad. Its scale is logarithmic."""
_EACH = 2.2  # em: width of a button
_STYLE = (
    "<style>{0}{{position:relative;margin:-2.6em 0.6em 0.6em auto;width:{1}em}}"
    "{0}>:last-child{{flex:1}}{0} {2}{{flex-wrap:nowrap!important;gap:0.2em!important}}"
    "{0}>:first-child{{position:absolute!important;width:1px!important;height:1px;padding:0!important;"
    "overflow:hidden;clip-path:inset(50%)}}"
    "{0} button{{padding:0;min-width:0;flex:1;height:2em}}</style>"
)
"""Puts the buttons at the right end of the text above them. Their label is for screen readers."""
_CUT = "min-width:0;overflow:hidden;text-overflow:ellipsis"


class LevelRow:
    """The row of one level. `details` is the folder of its settings; over the scene a row has none."""

    def __init__(
        self,
        gui: viser.GuiApi,
        name: str,
        colour: RGB,
        buttons: Sequence[str],
        hint: str,
        press: Callable[[str], None],
        opened: bool | None = False,
    ) -> None:
        """buttons: without the last one, which opens the settings; press: called with the button that was
        pressed; opened: whether the settings are open, or None for a row without settings."""
        buttons = (*buttons, MORE) if opened is not None else tuple(buttons)
        self._colour, self._others = colour, buttons[1:]
        self._folder = gui.add_folder(None)
        with self._folder:
            self._text = gui.add_html("")
            self._buttons = gui.add_button_group(
                name if opened is None else f"Level {name}", buttons, hint=hint
            )
            row = f'{ROW}:has(> * > * > label[for="{dom_id(self._buttons)}"])'
            gui.add_html(_STYLE.format(row, _EACH * len(buttons), ROW))
            if opened is not None:
                self.details = gui.add_folder(f"Settings of {name}", visible=opened)
        self._room = _EACH * len(buttons) + 1.5

        def pressed() -> None:
            button = str(self._buttons.value)
            if button == MORE:
                self.details.visible = not self.details.visible
            press(button)

        on_click(self._buttons, pressed)

    def update(
        self,
        place: int,
        title: str,
        on: bool,
        error: float = 0.0,
        error_words: str = "",
        free: str = "",
        about: str = "",
        fault: str = "",
    ) -> None:
        """Updates the row. Before the first control step there is neither an error nor a freedom.

        Args:
            place: the index of the level, 0 being the highest priority.
            title: its number and name.
            on: whether it is switched on.
            error, error_words: its error, m or rad, and the same in words.
            free: its freedom, in few words.
            about: an explanation of its freedom.
            fault: the fallback that was applied; "" for none.
        """
        if self._folder.order != float(place):
            self._folder.order = float(place)
        buttons = (ON if on else OFF, *self._others)
        if self._buttons.options != buttons:
            self._buttons.options = buttons
        share = math.log10(error / _LEAST) / -math.log10(_LEAST) if error > _LEAST else 0.0
        note = badge(fault, BAD) if fault else f'<span title="{esc(about)}">{esc(free)}</span>'
        line = "display:flex;justify-content:space-between;gap:0.6em;align-items:center;white-space:nowrap"
        self._text.content = (
            f'<div style="font-size:0.85em;line-height:1.35;height:2.8em;margin:0.2em 0 0.25em 0.75em;'
            f"padding:0 {self._room / 0.85:.1f}em 0 0.5em;border-left:5px solid {css(self._colour)};"
            f'overflow:hidden"><div style="{line}"><b style="{_CUT}" title="{esc(title)}">{esc(title)}</b>'
            f"<span>{error_words}</span></div>"
            f'<div style="{line}"><div style="flex:1">{bar(share if on else 0.0, self._colour)}</div>'
            f"{note}</div></div>"
        )


def error_in_words(errors: Sequence[tuple[str, float, str]]) -> str:
    """Returns errors as HTML, each given as name, value in m or rad, and unit. They have the order of the
    tasks in the level's name; each names its task when the mouse is over it."""
    return ", ".join(f'<b title="{esc(name)}">{quantity(value, unit)}</b>' for name, value, unit in errors)
